//! From the exemplar to a virtual texture over every polygon, and on to one baked atlas per crown (She §3.2, fig. 10–12).
