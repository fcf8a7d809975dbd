"""`python -m sicp_cam` is the command `sicp-cam`."""

from sicp_cam.cli import main

main()
