%
O0012
(porthole)
(corrected by sicp_cam)
(gates: all passed)
(not a safety function: verify at reduced speed)
(Fanuc G43.4 type 1: rotary words BC, head-head)
(units inch, dwell in seconds)
(coordinates in the scan frame: the work offset G54 must hold it)
G20 G90 G94 G17 G40
G54
G49
T3 M6
(LOADTL/3)
G43.4 H3
S12000 M3
G0 X3.937008 Y0.000000 Z0.196850 B16.6992 C0.0000
M8
G1 X3.858530 Y0.782163 Z0.197975 B16.6992 C11.4592 F78.7402
(first side)
G1 X3.626224 Y1.533143 Z0.199100 B16.6992 C22.9183
G4 X1.500
G1 X3.249353 Y2.223002 Z0.200225 B16.6992 C34.3775 F35.4331
M0
G1 X2.742940 Y2.824237 Z0.201350 B16.6992 C45.8366
G0 X2.127174 Y3.312878 Z0.202475 B16.6992 C57.2958
M9
M5
G49
M30
%
