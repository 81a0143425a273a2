//! The drawer of octahedral impostors (Brucks 2018).

/// How far an impostor's card reaches from its middle, in radii of what was captured: the corners of a square of that half side.
pub const REACH: f32 = 1.415;
