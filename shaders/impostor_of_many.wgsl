// Octahedral impostors of many placed trees, as impostor.wgsl draws them of each.
#import shared/corner_of_many
#import impostor
