//! Tables, pictures and findings, made from records alone: nothing here knows a model.

pub mod agreement;
pub mod averages;
pub mod choices;
pub mod curves;
pub mod differences;
pub mod durations;
pub mod fig07;
pub mod fig08;
pub mod fig10;
pub mod finding;
pub mod findings;
pub mod help;
pub mod html;
pub mod markdown;
pub mod multi_csv;
pub mod page;
pub mod published_fig10;
pub mod records_csv;
pub mod searches;
pub mod shared;
pub mod standings;
pub mod table3;
pub mod text_table;
