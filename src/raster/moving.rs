//! Moving pictures: GIF (everywhere, 256 colours) and WebP (smaller and truer).

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};
use webp_animation::{Encoder, EncoderOptions, EncodingConfig};

use crate::{Error, Result};

/// How long a picture stands, ms: 25 a second, which GIF's hundredths of a second can say.
pub const FRAME_MS: u32 = 40;

/// Quality of WebP frames, 0 to 100: foliage shows no blocks from here on.
const WEBP_QUALITY: f32 = 82.0;

/// Frames of one size as an endless GIF.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses a frame.
pub fn gif(frames: Vec<RgbaImage>) -> Result<Vec<u8>> {
    let failed = |e: image::ImageError| Error::Internal { stage: "writing a GIF", what: e.to_string() };
    let mut bytes = Vec::new();
    {
        let mut encoder = GifEncoder::new_with_speed(&mut bytes, 10);
        encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
        for frame in frames {
            let delay = Delay::from_numer_denom_ms(FRAME_MS, 1);
            encoder.encode_frame(Frame::from_parts(frame, 0, 0, delay)).map_err(failed)?;
        }
    }
    Ok(bytes)
}

/// Frames of one size as an endless WebP.
///
/// # Errors
/// [`Error::Internal`] when the encoder refuses a frame.
pub fn webp(frames: &[RgbaImage]) -> Result<Vec<u8>> {
    let failed = |e: webp_animation::Error| Error::Internal { stage: "writing a WebP", what: format!("{e:?}") };
    let Some(first) = frames.first() else {
        return Err(Error::Internal { stage: "writing a WebP", what: "it has no frames".to_owned() });
    };
    let config = EncodingConfig::new_lossy(WEBP_QUALITY);
    let options = EncoderOptions { encoding_config: Some(config), ..EncoderOptions::default() };
    let mut encoder = Encoder::new_with_options(first.dimensions(), options).map_err(failed)?;
    for (number, frame) in frames.iter().enumerate() {
        encoder.add_frame(frame.as_raw(), number as i32 * FRAME_MS as i32).map_err(failed)?;
    }
    Ok(encoder.finalize((frames.len() as u32 * FRAME_MS) as i32).map_err(failed)?.to_vec())
}
