"""Robots over Modbus TCP, their registers in a profile."""

from drivers.devices.modbus.driver import ModbusRobot

__all__ = ["ModbusRobot"]
