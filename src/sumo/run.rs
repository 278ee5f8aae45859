//! Runs SUMO: a straight road, a leader that gets its speed at every step, and behind it a vehicle of the exported type.

use super::SumoError;
use super::drive::{Drive, Motion};
use super::traci::Traci;
use super::vtype::VehicleType;
use crate::text::bounded::{self, TEXT_MAX};
use std::fs;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Road behind the follower's start and beyond the leader's end \[m\]: SUMO slows down towards the end of a road.
const MARGIN_M: f64 = 2000.0;
/// Length of the leader \[m\]; only the gap behind it matters.
const LEADER_M: f64 = 5.0;
/// Smallest speed limit of a lane and of a leader \[m/s\].
const FAST_MPS: f64 = 200.0;
/// Time limit for the start of SUMO.
const START: Duration = Duration::from_secs(30);

/// A SUMO that can be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Sumo {
    pub program: PathBuf,
    /// Its version message.
    pub version: String,
}

/// Finds SUMO: as given, otherwise below `SUMO_HOME`, otherwise on the path. The error names the places that were searched.
pub fn find(given: Option<&Path>) -> Result<Sumo, SumoError> {
    let name = format!("sumo{}", std::env::consts::EXE_SUFFIX);
    let home = std::env::var_os("SUMO_HOME").map(|home| PathBuf::from(home).join("bin").join(&name));
    let candidates: Vec<PathBuf> = match given {
        Some(path) if path.is_dir() => vec![path.join("bin").join(&name), path.join(&name)],
        Some(path) => vec![path.to_owned()],
        None => home.into_iter().chain([PathBuf::from(&name)]).collect(),
    };
    for program in &candidates {
        let output = Command::new(program).arg("--version").output();
        let Ok(output) = output else { continue };
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let version = said.lines().next().and_then(|line| line.split_whitespace().last()).map(str::to_owned);
        if let Some(version) = version.filter(|_| output.status.success()) {
            return Ok(Sumo { program: program.clone(), version });
        }
    }
    let tried: Vec<String> = candidates.iter().map(|path| path.display().to_string()).collect();
    Err(SumoError::NoSumo { tried: format!("{} cannot be run", tried.join(", ")) })
}

/// Names of the files of a drive for SUMO: road, demand, and SUMO's output.
pub fn files(suffix: &str) -> [String; 3] {
    [format!("road{suffix}.net.xml"), format!("demand{suffix}.rou.xml"), format!("sumo{suffix}.log")]
}

impl Sumo {
    /// The follower of the exported type behind the leader of the drive, from the same first state. SUMO's input and output are written to `folder`,
    /// by the names of [`files`]. Fails when files cannot be written, or SUMO ends early.
    pub fn follow(&self, vtype: &VehicleType, drive: &Drive, folder: &Path, suffix: &str) -> Result<Motion, SumoError> {
        let [road_name, demand_name, log_name] = files(suffix);
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(|source| SumoError::Io {
                what: format!("{}: cannot write the file", path.display()),
                source,
            })?;
            Ok(path)
        };
        let road = write(&road_name, road(drive))?;
        let demand = write(&demand_name, demand(vtype, drive))?;
        let log = folder.join(log_name);
        let io = |what: &str| {
            let what = what.to_owned();
            move |source| SumoError::Io { what, source }
        };
        // The system names a free port; SUMO listens there a moment later.
        let port = TcpListener::bind(("127.0.0.1", 0)).and_then(|listener| listener.local_addr());
        let port = port.map_err(io("no free port on this machine"))?.port();
        let sink = fs::File::create(&log).map_err(io("the log of SUMO cannot be written"))?;
        let errors = sink.try_clone().map_err(io("the log of SUMO cannot be written"))?;
        let child = Command::new(&self.program)
            .args([
                "--step-method.ballistic",
                vtype.model.ballistic(),
                "--collision.action",
                "none",
                "--time-to-teleport",
                "-1",
            ])
            .args(["--no-step-log", "true", "--xml-validation", "never", "--step-length", &drive.dt.to_string()])
            .args(["--remote-port", &port.to_string(), "--num-clients", "1"])
            .arg("--net-file")
            .arg(&road)
            .arg("--route-files")
            .arg(&demand)
            .stdin(Stdio::null())
            .stdout(sink)
            .stderr(errors)
            .spawn()
            .map_err(io("SUMO cannot be started"))?;
        let mut running = Running { child };
        let ended = |running: &mut Running, error: SumoError| {
            let gone = running.child.try_wait().ok().flatten().is_some();
            let said = bounded::read_to_string(&log, TEXT_MAX).unwrap_or_default();
            let said: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).take(4).collect();
            if gone { SumoError::Ended { program: self.program.clone(), said: said.join("; ") } } else { error }
        };
        match connect(&mut running, port).and_then(|stream| drive_on(&mut Traci::new(stream), drive)) {
            Ok(motion) => Ok(motion),
            Err(error) => Err(ended(&mut running, error)),
        }
    }
}

/// Ends SUMO when dropped, whatever happens.
struct Running {
    child: Child,
}

impl Drop for Running {
    fn drop(&mut self) {
        // Best effort: after a run it has already ended.
        let patience = Instant::now();
        while patience.elapsed() < Duration::from_secs(2) {
            if let Ok(Some(_)) = self.child.try_wait() {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn connect(running: &mut Running, port: u16) -> Result<TcpStream, SumoError> {
    let started = Instant::now();
    loop {
        match TcpStream::connect(("127.0.0.1", port)) {
            Ok(stream) => {
                // Many small messages, each followed by a wait.
                let _ = stream.set_nodelay(true);
                return Ok(stream);
            }
            Err(source) => {
                let gone = running.child.try_wait().ok().flatten().is_some();
                if gone || started.elapsed() > START {
                    return Err(SumoError::Io { what: "SUMO does not answer".to_owned(), source });
                }
            }
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn drive_on(traci: &mut Traci, drive: &Drive) -> Result<Motion, SumoError> {
    // Vehicles enter at the end of a step, so the first step only puts them on the road, with the first state of the drive.
    traci.step()?;
    traci.obey("leader")?;
    let mut motion = Motion::default();
    for i in 0..drive.t.len() {
        // A measured gap and two measured speeds never agree exactly, so the leader is put at its measured position.
        traci.move_to("leader", "road_0", MARGIN_M + LEADER_M + drive.x_l[i])?;
        let (v, x) = (traci.speed("follower")?, traci.position("follower")?);
        motion.s.push(traci.position("leader")? - LEADER_M - x);
        motion.v.push(v);
        motion.a.push(if i == 0 { drive.simulated.a[0] } else { (v - motion.v[i - 1]) / drive.dt });
        if let Some(next) = drive.v_l.get(i + 1) {
            traci.set_speed("leader", *next)?;
            traci.step()?;
        }
    }
    traci.close()?;
    Ok(motion)
}

fn length(drive: &Drive) -> f64 {
    (2.0 * MARGIN_M + drive.x_l[drive.x_l.len() - 1]).ceil()
}

/// One straight lane, written without netconvert.
fn road(drive: &Drive) -> String {
    let end = length(drive);
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<net version="1.16">
    <location netOffset="0.00,0.00" convBoundary="0.00,0.00,{end},0.00" origBoundary="0.00,0.00,{end},0.00" projParameter="!"/>
    <edge id="road" from="start" to="end" priority="1">
        <lane id="road_0" index="0" speed="{FAST_MPS}" length="{end}" shape="0.00,-1.60 {end},-1.60"/>
    </edge>
    <junction id="end" type="dead_end" x="{end}" y="0.00" incLanes="road_0" intLanes="" shape="{end},-3.20 {end},0.00"/>
    <junction id="start" type="dead_end" x="0.00" y="0.00" incLanes="" intLanes="" shape="0.00,0.00 0.00,-3.20"/>
</net>
"#
    )
}

/// Both vehicles with the state of the first sample.
fn demand(vtype: &VehicleType, drive: &Drive) -> String {
    let (x_f, s, v, v_l) = (MARGIN_M, drive.simulated.s[0], drive.simulated.v[0], drive.v_l[0]);
    let x_l = x_f + s + LEADER_M;
    let type_of_follower = vtype.element("follower");
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<routes>
    {type_of_follower}
    <vType id="leader" length="{LEADER_M}" accel="100" decel="100" emergencyDecel="100" maxSpeed="{FAST_MPS}" speedFactor="1" speedDev="0" sigma="0"/>
    <route id="road" edges="road"/>
    <vehicle id="leader" type="leader" route="road" depart="0" departPos="{x_l}" departSpeed="{v_l}" insertionChecks="none"/>
    <vehicle id="follower" type="follower" route="road" depart="0" departPos="{x_f}" departSpeed="{v}" insertionChecks="none"/>
</routes>
"#
    )
}
