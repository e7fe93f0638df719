# docker build -t navbench . ; docker run --rm -v "$PWD/results:/data/results" navbench run --stack nav2-gps --episodes 5
FROM python:3.11-slim
RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY pyproject.toml constraints.txt hatch_build.py README.md LICENSE NOTICE ./
COPY navbench navbench
COPY navstack navstack
COPY harness harness
COPY maps maps
COPY params params
RUN pip install --no-cache-dir -c constraints.txt . && rm -rf /src
WORKDIR /data
ENTRYPOINT ["navbench"]
