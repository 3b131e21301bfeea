"""What moves joints for long: walks, paths, and motions made of key frames with the ways between postures."""
