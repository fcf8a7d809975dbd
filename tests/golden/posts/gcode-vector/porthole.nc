%
(porthole)
(corrected by sicp_cam)
(gates: all passed)
(not a safety function: verify at reduced speed)
(Fanuc G43.5 type 2: I J K points from the tip to the holder)
(units mm, dwell in seconds)
(coordinates in the scan frame: the active work offset must hold it)
G21 G90 G94 G17 G40
G49
T3 M6
(LOADTL/3)
G43.5 H3
S12000 M3
G0 X100.0000 Y0.0000 Z5.0000 I0.287348 J0.000000 K0.957826
M8
G1 X98.0067 Y19.8669 Z5.0286 I0.281620 J0.057087 K0.957826 F2000.
(first side)
G1 X92.1061 Y38.9418 Z5.0571 I0.264665 J0.111899 K0.957826
G4 X1.500
G1 X82.5336 Y56.4642 Z5.0857 I0.237158 J0.162249 K0.957826 F900.
M0
G1 X69.6707 Y71.7356 Z5.1143 I0.200197 J0.206131 K0.957826
G0 X54.0302 Y84.1471 Z5.1429 I0.155255 J0.241795 K0.957826
M9
M5
G49
M30
%
