//! Pictures for people: every stage drawn over the photograph, and contact sheets.
