// What of surfaces of many placed trees casts shadows, as cast.wgsl has it of each.
#import shared/corner_of_many
#import cast
