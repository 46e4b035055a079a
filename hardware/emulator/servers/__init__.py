"""The emulator's four ports: RTDE, script upload, dashboard and admin, one session a client."""
