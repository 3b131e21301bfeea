"""The client's side of calls: how they are sent, waited for, and explained when no answer comes."""
