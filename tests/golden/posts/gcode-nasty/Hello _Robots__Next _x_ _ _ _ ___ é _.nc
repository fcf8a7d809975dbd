%
(Hello "Robots" Next x ' ]]> e ?)
(Hello "Robots" Next x ' ]]> e ?)
(]0x bell)
(- msg,active)
(not a safety function: verify at reduced speed)
(Fanuc G43.5 type 2: I J K points from the tip to the holder)
(units mm, dwell in seconds)
(coordinates in the scan frame: the active work offset must hold it)
G21 G90 G94 G17 G40
G49
T1 M6
(Hello "Robots" Next x ' ]]> e ?)
G43.5 H1
G0 X0.0000 Y0.0000 Z5.0000 I0.287348 J0.000000 K0.957826
(Hello "Robots" Next x ' ]]> e ?)
M0
G1 X10.0000 Y0.0000 Z5.0000 I0.155255 J0.241795 K0.957826 F600.
G49
M30
%
