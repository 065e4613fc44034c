# One image for the service, its workers and the emulators; docker-compose.yml says which runs what.
FROM python:3.11-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends libpango-1.0-0 libpangoft2-1.0-0 \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /opt/robocal
COPY requirements.lock .
RUN pip install --no-cache-dir -r requirements.lock
COPY pyproject.toml README.md ./
COPY robocal robocal
COPY drivers drivers
COPY service service
COPY migrations migrations
# Editable: the migrations stay beside the packages.
RUN pip install --no-cache-dir --no-deps -e . && useradd --create-home robocal
USER robocal
ENV OPENBLAS_NUM_THREADS=1
CMD ["robocal", "serve"]
