"""What travels: payloads, attachments and errors as bytes, checked as they arrive."""
