"""What programs of a G1's maker ask for over DDS."""
