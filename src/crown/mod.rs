//! From outlines to a closed sphere-board surface (She §3.1, fig. 8–9).
//!
//! Object space: metres, +Y up, origin at the foot of the trunk, +Z towards the photographer of azimuth 0.
