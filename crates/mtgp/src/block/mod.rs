//! Complete block designs, in which every task is observed at the same inputs: eqs. (17), (18) and (23)–(26).

mod complete_block;
mod noise_free;
mod posterior;
mod prediction;

pub use complete_block::CompleteBlock;
pub use noise_free::NoiseFreeBlock;
pub use posterior::{BlockGradient, BlockPosterior};
