//! Ready CDR bytes as the payload of DDS samples.

use std::convert::Infallible;

use rustdds::{
    RepresentationIdentifier,
    bytes::Bytes,
    no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter},
};

use crate::ros::wire::LITTLE_ENDIAN;

/// The other encapsulation header of plain CDR; DDS keeps both apart from the payload.
const BIG_ENDIAN: [u8; 4] = [0, 0, 0, 0];

/// Passes bytes through: out without the header, in with it.
pub(super) struct CdrBytes;

/// The decoder of [`CdrBytes`].
#[derive(Clone)]
pub(super) struct Verbatim;

impl SerializerAdapter<Bytes> for CdrBytes {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(payload: &Bytes) -> Result<Bytes, Infallible> {
        Ok(payload.clone())
    }
}

impl DeserializerAdapter<Vec<u8>> for CdrBytes {
    type Error = Infallible;
    type Decoded = Vec<u8>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[
            RepresentationIdentifier::CDR_LE,
            RepresentationIdentifier::CDR_BE,
        ]
    }

    fn transform_decoded(decoded: Vec<u8>) -> Vec<u8> {
        decoded
    }
}

impl DefaultDecoder<Vec<u8>> for CdrBytes {
    type Decoder = Verbatim;
    const DECODER: Verbatim = Verbatim;
}

impl Decode<'_, Vec<u8>> for Verbatim {
    type Error = Infallible;

    fn decode_bytes(
        self,
        payload: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Vec<u8>, Infallible> {
        let header = if encoding == RepresentationIdentifier::CDR_BE {
            BIG_ENDIAN
        } else {
            LITTLE_ENDIAN
        };
        Ok([&header, payload].concat())
    }
}
