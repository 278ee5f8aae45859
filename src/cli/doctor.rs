//! `leadlag doctor`: GPUs, drivers, and their arithmetic.

use super::output;
use crate::evaluator::EvaluateError;
use crate::gpu::{Adapter, AdapterChoice, CpuFunctions, Probe, modes, probes};
use crate::lanes;
use crate::report::text::wrapped;
use serde_json::{Map, Value, json};
use std::fmt::Write;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The adapter to examine [default: the one that auto would use]
    #[arg(long, value_name = "INDEX|PCI|NAME")]
    gpu: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const ON_THE_CPU: CpuFunctions =
    CpuFunctions { power: lanes::power, exponential: lanes::exponential, logarithm: lanes::logarithm };

pub fn run(args: &Args) -> anyhow::Result<()> {
    let adapters = Adapter::all();
    let choice = args.gpu.clone().map_or(AdapterChoice::Best, AdapterChoice::Named);
    let chosen = match Adapter::choose(&choice) {
        Ok(adapter) => Some(adapter),
        // Without any adapter, the output says what to install.
        Err(EvaluateError::Adapter { .. }) if adapters.is_empty() => None,
        Err(e) => return Err(e.into()),
    };
    let found = chosen.as_ref().map_or_else(Vec::new, |adapter| probes(adapter, &ON_THE_CPU));
    if args.json {
        return output::print_json(&report(&adapters, &found, chosen.as_ref()));
    }
    output::print(&text(&adapters, &found, chosen.as_ref())?)
}

fn report(adapters: &[Adapter], found: &[Probe], chosen: Option<&Adapter>) -> Value {
    let safe: Vec<&str> = modes(found).iter().filter(|mode| mode.safe).map(|mode| mode.name).collect();
    let adapter = |a: &Adapter| {
        // Only examined adapters are known.
        let safe_modes = chosen.filter(|chosen| chosen.index == a.index).map(|_| &safe);
        let limits: Map<String, Value> = a.limits().into_iter().map(|(name, x)| (name.to_owned(), x.into())).collect();
        json!({
            "index": a.index, "name": a.info.name, "type": a.kind(), "backend": a.info.backend.to_string(),
            "driver": a.driver(), "pci": a.pci(), "features": a.features(), "limits": limits, "safe_modes": safe_modes,
        })
    };
    let probe = |p: &Probe| json!({"name": p.name, "status": p.status.to_string(), "detail": p.detail});
    json!({
        "schema_version": 1,
        "adapters": adapters.iter().map(adapter).collect::<Vec<_>>(),
        "probes": found.iter().map(probe).collect::<Vec<_>>(),
        "chosen": chosen.map(|a| a.index),
    })
}

fn text(adapters: &[Adapter], found: &[Probe], chosen: Option<&Adapter>) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let Some(chosen) = chosen else {
        text += &wrapped(
            0,
            0,
            "No GPU adapter found: neither Vulkan, Metal nor DirectX 12 offers one. leadlag works without one; its fast CPU \
             evaluator (--evaluator lanes) needs no driver.",
        );
        text += "\nTo use a GPU, install its manufacturer's driver. To try the GPU evaluator\nwithout a GPU, install a \
                 software driver:\n\n";
        text += "  Debian, Ubuntu   apt-get install mesa-vulkan-drivers libvulkan1\n";
        text += "  Fedora           dnf install mesa-vulkan-drivers vulkan-loader\n";
        text += "  Arch             pacman -S vulkan-swrast vulkan-icd-loader\n";
        text += "\nInside a container, also pass the device through (for NVIDIA: --gpus all\nwith the `graphics` capability).\n";
        return Ok(text);
    };
    text += "Adapters\n\n";
    for adapter in adapters {
        let used = if adapter.index == chosen.index { " (examined below)" } else { "" };
        text += &wrapped(2, 5, &format!("{}  {}{used}", adapter.index, adapter.info.name));
        let kind =
            if adapter.is_hardware() { adapter.kind().to_owned() + " GPU" } else { "software, runs on the CPU".into() };
        let mut line = format!("{kind}; {}; driver {}", adapter.info.backend, adapter.driver());
        if !adapter.pci().is_empty() {
            write!(line, "; PCI {}", adapter.pci())?;
        }
        text += &wrapped(5, 5, &line);
        let [(_, piece), (_, buffer), (_, groups), (_, invocations), (_, buffers)] = adapter.limits();
        let (piece, buffer) = (piece >> 20, buffer >> 20);
        let limits = format!(
            "limits: buffers of {buffer} MiB, {piece} MiB of it in one piece, {buffers} at a time; {groups} workgroups a \
             dimension, of {invocations} invocations"
        );
        text += &wrapped(5, 13, &limits);
        let features = adapter.features().join(", ");
        text += &wrapped(
            5,
            15,
            &format!("features: {}", if features.is_empty() { "none of the known ones" } else { &features }),
        );
    }
    if !chosen.is_hardware() {
        text += "\n";
        text += &wrapped(
            0,
            0,
            "There is no hardware GPU. The software adapter is good for tests, but --evaluator lanes is several times \
             faster on the same CPU.",
        );
    }
    text += "\nArithmetic of the driver\n\n";
    for Probe { name, status, detail } in found {
        text += &wrapped(2, 30, &format!("{status:<8}{name:<20}{detail}"));
    }
    text += "\nok: correct; trap: wrong, but leadlag works around it; fail: unreliable.\n";
    text += "\nModes that are safe on this adapter\n\n";
    for mode in modes(found) {
        let answer = if mode.safe { "yes" } else { "NO" };
        text += &wrapped(2, 24, &format!("{answer:<8}{:<14}{}", mode.name, mode.promise));
    }
    text += "\n";
    text += &wrapped(
        0,
        0,
        "Always on: no access outside of a buffer, a bound on every loop, NaN found by its bits, error terms hidden from the \
         compiler, leadlag's own power function.",
    );
    if !modes(found).iter().any(|mode| mode.name == "plain" && mode.safe) {
        text += "\n";
        text += &wrapped(0, 0, "This adapter is not fit for use: update its driver, or choose another with --gpu.");
    }
    Ok(text)
}
