"""Rules about AMCL."""

from collections.abc import Iterator

from navstack.params.lint.rule import Finding, RuleGroup
from navstack.params.lint.subject import Subject

AMCL = "amcl"
FEWEST_BEAMS, FEWEST_PARTICLES = 20, 200
LONGEST_DRIFT = 0.5  # [m] between two corrections
SHORTEST_TOLERANCE = 0.1  # [s]

RULES = RuleGroup("AMCL", AMCL)


def _particles(subject: Subject, key: str, usual: float) -> float:
    """A number of particles; Nav2 takes its own for a negative one."""
    number = subject.number(AMCL, key, usual)
    return number if number >= 0.0 else usual


@RULES.warning
def crossed_particles(subject: Subject) -> Iterator[Finding]:
    """AMCL's min_particles lies above max_particles.

    Why: AMCL always has this one number of particles, more than the file allows, and never gets
    quicker once it knows where it is.
    """
    low = _particles(subject, "min_particles", 500.0)
    high = _particles(subject, "max_particles", 2000.0)
    if subject.has(AMCL) and low > high:
        note = subject.default_note(AMCL, "min_particles", " by default")
        yield Finding(
            "max_particles" if note else "min_particles",
            f"max_particles is {high:.0f}, but min_particles {low:.0f}{note}: "
            f"Nav2 raises max_particles to {low:.0f}",
            f"min_particles: {high / 4.0:.0f}",
        )


@RULES.warning
def few_particles(subject: Subject) -> Iterator[Finding]:
    """AMCL has very few particles.

    Why: after a bad start or a bump no particle is near the truth, and the robot stays lost.
    """
    high = _particles(subject, "max_particles", 2000.0)
    if subject.has(AMCL) and high < FEWEST_PARTICLES:
        yield Finding("max_particles", f"{high:.0f}", "max_particles: 2000")


@RULES.warning
def few_beams(subject: Subject) -> Iterator[Finding]:
    """AMCL looks at very few beams.

    Why: a passing pedestrian covers a good part of them and pulls the belief away.
    """
    beams = subject.number(AMCL, "max_beams", 60.0)
    if subject.has(AMCL) and beams < FEWEST_BEAMS:
        yield Finding("max_beams", f"{beams:.0f} of a scan", "max_beams: 60")


@RULES.warning
def blind_likelihood(subject: Subject) -> Iterator[Finding]:
    """AMCL's z_hit is 0.

    Why: the map has no influence on the particles' weights: the belief is odometry.
    """
    if subject.has(AMCL) and subject.number(AMCL, "z_hit", 0.5) <= 0.0:
        yield Finding("z_hit", f"{subject.number(AMCL, 'z_hit', 0.5):g}", "z_hit: 0.5, z_rand: 0.5")


@RULES.warning
def rare_corrections(subject: Subject) -> Iterator[Finding]:
    """AMCL corrects rarely.

    Why: in between the robot drives on odometry, whose errors then come as one jump.
    """
    distance = subject.number(AMCL, "update_min_d", 0.25)
    if subject.has(AMCL) and distance > LONGEST_DRIFT:
        yield Finding(
            "update_min_d", f"{distance:g} m between two corrections", "update_min_d: 0.25"
        )


@RULES.warning
def short_lived_transform(subject: Subject) -> Iterator[Finding]:
    """AMCL's transform expires quickly.

    Why: costmaps and controller wait for the next scan or fail with extrapolation errors.
    """
    tolerance = subject.number(AMCL, "transform_tolerance", 1.0)
    if subject.has(AMCL) and tolerance < SHORTEST_TOLERANCE:
        yield Finding("transform_tolerance", f"{tolerance:g} s", "transform_tolerance: 1.0")
