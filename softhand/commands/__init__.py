"""The commands: each reads what is asked, calls the library, prints. No physics here."""
