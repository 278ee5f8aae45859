//! The few commands of SUMO's control protocol (TraCI, version 20 and later) that are needed to drive one car by a speed profile.

use super::SumoError;
use std::io::{Read, Write};
use std::net::TcpStream;

const STEP: u8 = 0x02;
const CLOSE: u8 = 0x7F;
const GET_VEHICLE: u8 = 0xA4;
const SET_VEHICLE: u8 = 0xC4;
const SPEED: u8 = 0x40;
const LANE_POSITION: u8 = 0x56;
const SPEED_MODE: u8 = 0xB3;
const MOVE_TO: u8 = 0x5C;
const INTEGER: u8 = 0x09;
const DOUBLE: u8 = 0x0B;
const TEXT: u8 = 0x0C;
const COMPOUND: u8 = 0x0F;
/// Longest answer to these commands \[bytes\]; a longer one is invalid.
const ANSWER_MAX: usize = 1 << 20;

/// A connection to a running SUMO.
pub(super) struct Traci {
    stream: TcpStream,
}

/// An answer, parsed from its start.
struct Answer {
    bytes: Vec<u8>,
    at: usize,
}

impl Traci {
    pub fn new(stream: TcpStream) -> Self {
        Traci { stream }
    }

    /// Advances by one step.
    pub fn step(&mut self) -> Result<(), SumoError> {
        self.command(STEP, &0f64.to_be_bytes(), "make a step").map(drop)
    }

    /// Sets the speed that a vehicle has after the next step \[m/s\].
    pub fn set_speed(&mut self, vehicle: &str, speed: f64) -> Result<(), SumoError> {
        let mut content = variable(SPEED, vehicle);
        content.push(DOUBLE);
        content.extend(speed.to_be_bytes());
        self.command(SET_VEHICLE, &content, "set a speed").map(drop)
    }

    /// Puts a vehicle at a position of a lane \[m\].
    pub fn move_to(&mut self, vehicle: &str, lane: &str, position: f64) -> Result<(), SumoError> {
        let mut content = variable(MOVE_TO, vehicle);
        content.push(COMPOUND);
        content.extend(2i32.to_be_bytes());
        content.push(TEXT);
        content.extend((lane.len() as i32).to_be_bytes());
        content.extend(lane.as_bytes());
        content.push(DOUBLE);
        content.extend(position.to_be_bytes());
        self.command(SET_VEHICLE, &content, "move a vehicle").map(drop)
    }

    /// SUMO takes speeds without checks.
    pub fn obey(&mut self, vehicle: &str) -> Result<(), SumoError> {
        let mut content = variable(SPEED_MODE, vehicle);
        content.push(INTEGER);
        content.extend(0i32.to_be_bytes());
        self.command(SET_VEHICLE, &content, "take speeds as told").map(drop)
    }

    /// Speed \[m/s\].
    pub fn speed(&mut self, vehicle: &str) -> Result<f64, SumoError> {
        self.get(SPEED, vehicle, "tell a speed")
    }

    /// Position of the front bumper on the lane \[m\].
    pub fn position(&mut self, vehicle: &str) -> Result<f64, SumoError> {
        self.get(LANE_POSITION, vehicle, "tell a position")
    }

    pub fn close(&mut self) -> Result<(), SumoError> {
        self.command(CLOSE, &[], "end").map(drop)
    }

    fn get(&mut self, what: u8, vehicle: &str, words: &'static str) -> Result<f64, SumoError> {
        let mut answer = self.command(GET_VEHICLE, &variable(what, vehicle), words)?;
        // Length, command, variable, vehicle, type, value.
        if answer.byte()? == 0 {
            answer.take(4)?;
        }
        answer.take(2)?;
        answer.text()?;
        if answer.byte()? != DOUBLE {
            return Err(broken("expected a number from SUMO, found another type"));
        }
        let bytes = answer.take(8)?;
        Ok(f64::from_be_bytes(bytes.try_into().expect("eight bytes were taken")))
    }

    /// Sends one command and checks the status that SUMO answers with.
    fn command(&mut self, id: u8, content: &[u8], words: &'static str) -> Result<Answer, SumoError> {
        let io =
            |source| SumoError::Io { what: format!("the connection to SUMO broke at the command to {words}"), source };
        let length = 2 + content.len();
        let mut message = Vec::with_capacity(length + 8);
        if length <= usize::from(u8::MAX) {
            message.push(length as u8);
        } else {
            message.push(0);
            message.extend((length as i32 + 4).to_be_bytes());
        }
        message.push(id);
        message.extend(content);
        let mut whole = (message.len() as i32 + 4).to_be_bytes().to_vec();
        whole.append(&mut message);
        self.stream.write_all(&whole).map_err(io)?;
        let mut length = [0; 4];
        self.stream.read_exact(&mut length).map_err(io)?;
        let length = usize::try_from(i32::from_be_bytes(length)).unwrap_or(0);
        if !(4..=ANSWER_MAX).contains(&length) {
            return Err(broken("expected an answer of SUMO, found something else"));
        }
        let mut bytes = vec![0; length - 4];
        self.stream.read_exact(&mut bytes).map_err(io)?;
        let mut answer = Answer { bytes, at: 0 };
        if answer.byte()? == 0 {
            answer.take(4)?;
        }
        answer.byte()?;
        let status = answer.byte()?;
        let said = answer.text()?;
        if status == 0 { Ok(answer) } else { Err(SumoError::Refused { what: words, said }) }
    }
}

/// Variable and vehicle, with which every command about a vehicle begins.
fn variable(variable: u8, vehicle: &str) -> Vec<u8> {
    let mut content = vec![variable];
    content.extend((vehicle.len() as i32).to_be_bytes());
    content.extend(vehicle.as_bytes());
    content
}

fn broken(what: &str) -> SumoError {
    SumoError::Io { what: what.to_owned(), source: std::io::ErrorKind::InvalidData.into() }
}

impl Answer {
    fn take(&mut self, count: usize) -> Result<&[u8], SumoError> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| broken("an answer of SUMO ends too early"))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, SumoError> {
        self.take(1).map(|bytes| bytes[0])
    }

    fn text(&mut self) -> Result<String, SumoError> {
        let length = self.take(4)?;
        let length = i32::from_be_bytes(length.try_into().expect("four bytes were taken"));
        let bytes = self.take(usize::try_from(length).unwrap_or(usize::MAX))?;
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}
