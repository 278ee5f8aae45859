//! The plot: small, reproducible, and well-formed for any content.

use leadlag::internal::report::panel::{Panel, Series, Style};
use leadlag::internal::report::svg::{SvgError, render};

fn series(name: &str, style: Style, values: Vec<f64>) -> Series {
    Series { name: name.to_owned(), values, style }
}

/// Seven noisy lines, as rough as measured signals.
fn panels(samples: usize) -> (Vec<f64>, Vec<Panel>) {
    let t: Vec<f64> = (0..samples).map(|i| i as f64 / 10.0).collect();
    let wave = |offset: f64| -> Vec<f64> {
        t.iter().map(|t| 20.0 + 8.0 * (t * 0.05 + offset).sin() + 0.5 * (t * 97.0 + offset).sin()).collect()
    };
    let pair = |label: &str| Panel {
        label: label.to_owned(),
        series: vec![series("observed", Style::Observed, wave(0.0)), series("simulated", Style::Simulated, wave(0.3))],
    };
    let mut panels = vec![pair("spacing s [m]"), pair("speed v [m/s]"), pair("acceleration a [m/s²]")];
    let ahead = series("preceding car", Style::Context, wave(0.1));
    panels[1].series.insert(0, ahead);
    (t, panels)
}

#[test]
fn long_drives_stay_small() {
    let (t, panels) = panels(22_000);
    let svg = render("P7 follower 1", &t, &panels).expect("drawable");
    assert!(svg.len() < 400_000, "{} bytes", svg.len());
    assert_eq!(svg, render("P7 follower 1", &t, &panels).expect("drawable"));
}

#[test]
fn says_what_it_shows() {
    let (t, panels) = panels(600);
    let svg = render("a < b & \"c\"", &t, &panels).expect("drawable");
    assert!(svg.contains("width=\"1000\" height=\"800\" viewBox=\"0 0 1000 800\""));
    for words in ["spacing s [m]", "speed v [m/s]", "acceleration a [m/s²]", "time [s]", "a &lt; b &amp; \"c\""] {
        assert!(svg.contains(words), "{words}");
    }
    for listed_once in [">observed<", ">simulated<", ">preceding car<"] {
        assert_eq!(svg.matches(listed_once).count(), 1, "{listed_once}");
    }
}

#[test]
fn odd_data_can_be_drawn() {
    let t = [0.0, 1.0, 2.0, 3.0];
    for values in [
        [f64::NAN; 4],
        [5.0; 4],
        [1.0, f64::NAN, 2.0, f64::NAN],
        [0.0, f64::INFINITY, -1e300, 1e300],
        [1e-300, 0.0, 0.0, 0.0],
    ] {
        let panel = Panel { label: "x".to_owned(), series: vec![series("odd", Style::Alternative, values.to_vec())] };
        let svg = render(&"long title ".repeat(100), &t, &[panel]).expect("drawable");
        assert!(svg.ends_with("</svg>\n") && svg.len() < 100_000);
    }
}

#[test]
fn refuses_what_does_not_fit() {
    let (t, mut panels) = panels(10);
    panels[1].series[0].values.pop();
    assert_eq!(
        render("", &t, &panels).expect_err("too short").to_string(),
        "series `preceding car` of panel `speed v [m/s]`: expected 10 values, one per time, found 9"
    );
    assert!(matches!(render("", &t, &[]), Err(SvgError::NoPanels)));
    for (t, at) in [(vec![], 0), (vec![1.0], 1), (vec![0.0, f64::NAN], 1), (vec![0.0, 1.0, 1.0], 2)] {
        match render("", &t, &panels) {
            Err(SvgError::Time { at: found, .. }) => assert_eq!(found, at, "{t:?}"),
            other => panic!("{t:?}: {other:?}"),
        }
    }
}
