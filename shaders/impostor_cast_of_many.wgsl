// Octahedral impostors of many placed trees in the sun's map, as impostor_cast.wgsl draws them of each.
#import shared/corner_of_many
#import impostor_cast
