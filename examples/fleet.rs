//! Many drivers: every pair calibrated separately, with two models.
//!
//!     cargo run --release --example fleet

use leadlag::{Error, Fleet, Pairs, Values, synthetic};

fn main() -> Result<(), Error> {
    // Your own tables: Pairs::read(&Reading::default(), &["pairs.csv"])?
    let drives = (1..=20).map(|seed| synthetic(seed, 60.0)?.follower(1)).collect::<Result<Vec<_>, Error>>()?;
    let pairs = Pairs::of_drives(&drives.iter().collect::<Vec<_>>());
    let table = Fleet::of(&["idm", "gipps"])?.each(|calibration| calibration.intervals(false)).run(&pairs)?;
    let column = |name: &str| table.columns.iter().find(|column| column.name == name).map(|column| &column.values);
    if let (Some(Values::Text(models)), Some(Values::Number(scores))) = (column("model"), column("score")) {
        for (model, score) in models.iter().zip(scores) {
            println!("{:<6} {:.4}", model.as_deref().unwrap_or_default(), score.unwrap_or(f64::NAN));
        }
    }
    Ok(())
}
