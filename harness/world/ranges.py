"""What rates and delays of sensors may be."""

from typing import Annotated

from navstack.ranges import up_to, within

Rate = Annotated[float, up_to(10_000)]  # [Hz]
Latency = Annotated[float, within(0, 60)]  # [s]
