"""MuJoCo's writer of USD files, under robosuite's name; needs `usd-core`."""

from mujoco.usd import exporter

USDExporter = exporter.USDExporter
