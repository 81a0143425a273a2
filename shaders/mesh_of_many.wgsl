// Surfaces of many placed trees (render::crowd), as mesh.wgsl draws them of each.
#import shared/corner_of_many
#import mesh
