//! Every composed text is valid WGSL, and errors point into the file that they are in.

use leadlag::catalog::Variant;
use leadlag::convention::Radicand;
use leadlag::wgsl::{Precision, Recipe, Source, check};

#[test]
fn every_variant_composes() {
    for variant in Variant::all() {
        for precision in [Precision::Plain, Precision::Compensated] {
            for radicand in [Radicand::Measured, Radicand::Shifted] {
                let source = Source::model(&Recipe { variant, precision, radicand });
                check(&source).unwrap_or_else(|e| panic!("{variant}: {e}"));
            }
        }
    }
}
