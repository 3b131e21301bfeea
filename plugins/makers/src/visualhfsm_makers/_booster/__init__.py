"""What programs for a T1's `B1LocoClient` ask for over DDS."""
