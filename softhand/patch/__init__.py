"""Friction inside a contact: which part of it slips already, and models of others beside it."""
