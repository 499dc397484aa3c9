"""Specs of each model, written in Python; made of the descriptions of the models."""

from sprag_study.service.client.machines.machine_shaft import Shaft
from sprag_study.service.client.machines.vibration_drive import Drive

__all__ = ["Drive", "Shaft"]
