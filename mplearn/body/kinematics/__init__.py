"""Kinematics of any body as arrays: where its parts are, how points move with its joints."""
