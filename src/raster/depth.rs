//! Depth pictures as OpenEXR files: one 32-bit float channel `Z`, metres, infinity where nothing is (OpenEXR's own convention).

use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec, WritableImage as _};

use crate::{Error, Result};

/// A depth picture, row by row from the top left, as an EXR file.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses it, which it does for none of at least one pixel.
pub fn exr_depth(size_px: [u32; 2], depth_m: &[f32]) -> Result<Vec<u8>> {
    let size = (size_px[0] as usize, size_px[1] as usize);
    let channel = AnyChannel::new("Z", FlatSamples::F32(depth_m.to_vec()));
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![channel]));
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let mut file = Cursor::new(Vec::new());
    let written = Image::from_layer(layer).write().to_buffered(&mut file);
    written.map_err(|e| Error::Internal { stage: "writing depth", what: e.to_string() })?;
    Ok(file.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{ReadChannels as _, ReadLayers as _};

    #[test]
    fn every_depth_comes_back_bit_for_bit() {
        let depth = [1.0, 2.5, f32::INFINITY, 1e-3, 1e6, 7.25];
        let bytes = exr_depth([3, 2], &depth).unwrap();
        let image = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
        let image = image.all_attributes().from_buffered(Cursor::new(bytes)).unwrap();
        let channel = &image.layer_data.channel_data.list[0];
        assert_eq!((channel.name.to_string().as_str(), image.layer_data.size.into()), ("Z", (3, 2)));
        assert_eq!(channel.sample_data, FlatSamples::F32(depth.to_vec()));
    }
}
