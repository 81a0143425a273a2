//! The tree model, the pipeline that makes it from a photograph, and its GLB file (DESIGN §4–5).
