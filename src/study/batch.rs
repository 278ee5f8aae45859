//! Many calibrations on one evaluator: their concurrent requests become one job table.
//!
//! Each calibration runs in a separate thread and uses an evaluator of its one case, an [`Outpost`]. The evaluator itself stays in one
//! place, the [`Post`], which waits for the requests of the running calibrations, simulates everything in one go, and answers. The score of
//! a candidate does not depend on its neighbours, so neither does any result.

use crate::evaluator::{BufferSet, Case, EvaluateError, Evaluator, Job, Outcome, Population, Score};
use crate::score::GoodnessOfFit;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Request of a calibration.
struct Request {
    /// The group of calibrations it belongs to, 0 or 1.
    group: usize,
    jobs: Vec<(usize, Population)>,
    want: Want,
}

/// The requested results, and their destination.
enum Want {
    Scores(Sender<Vec<Score>>),
    Outcomes(Sender<Vec<Outcome>>),
}

/// Message of a calibration to the post.
enum Message {
    Request(Request),
    /// The thread ends.
    Gone(usize),
}

/// The evaluator of one calibration: its one case, simulated by the shared evaluator.
pub struct Outpost {
    cases: Vec<Case>,
    /// Index of the case at the shared evaluator.
    case: usize,
    gof: GoodnessOfFit,
    identity: Arc<Mutex<Identity>>,
    group: usize,
    to_post: Sender<Message>,
    /// The answers to the last request of each buffer set.
    answers: [Option<Receiver<Vec<Score>>>; 2],
}

/// The evaluator; under `auto` another one may replace it.
struct Identity {
    name: &'static str,
    precision: &'static str,
    adapter: Option<String>,
}

impl Identity {
    fn of(evaluator: &dyn Evaluator) -> Identity {
        Identity { name: evaluator.name(), precision: evaluator.precision(), adapter: evaluator.adapter() }
    }
}

fn lock(identity: &Mutex<Identity>) -> std::sync::MutexGuard<'_, Identity> {
    identity.lock().expect("no thread panics with it")
}

/// A thread's connection to the post; reports the end of the thread.
pub struct Line {
    group: usize,
    to_post: Sender<Message>,
    gof: GoodnessOfFit,
    identity: Arc<Mutex<Identity>>,
}

impl Line {
    /// An evaluator of one case of the shared one.
    pub fn outpost(&self, case: usize, content: Case) -> Outpost {
        Outpost {
            cases: vec![content],
            case,
            gof: self.gof,
            identity: Arc::clone(&self.identity),
            group: self.group,
            to_post: self.to_post.clone(),
            answers: [None, None],
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        // A closed post needs no message.
        let _ = self.to_post.send(Message::Gone(self.group));
    }
}

/// The post has closed, because the evaluator failed; the post itself has the reason.
#[derive(Debug, thiserror::Error)]
#[error("the evaluator that all calibrations share has stopped")]
pub struct Closed;

fn closed() -> EvaluateError {
    EvaluateError::Model(Box::new(Closed))
}

impl Outpost {
    fn request(&self, jobs: &[Job<'_>], want: Want) -> Result<(), EvaluateError> {
        let jobs = jobs.iter().map(|job| (self.case, job.population.clone())).collect();
        self.to_post.send(Message::Request(Request { group: self.group, jobs, want })).map_err(|_| closed())
    }
}

impl Evaluator for Outpost {
    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn gof(&self) -> &GoodnessOfFit {
        &self.gof
    }

    fn name(&self) -> &'static str {
        lock(&self.identity).name
    }

    fn precision(&self) -> &'static str {
        lock(&self.identity).precision
    }

    fn adapter(&self) -> Option<String> {
        lock(&self.identity).adapter.clone()
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let (answer, receiver) = channel();
        self.answers[set as usize] = Some(receiver);
        self.request(jobs, Want::Scores(answer))
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        let answer = self.answers[set as usize].take().expect("collect follows submit");
        let computed = answer.recv().map_err(|_| closed())?;
        if scores.len() != computed.len() {
            return Err(EvaluateError::Room { candidates: computed.len(), scores: scores.len() });
        }
        scores.copy_from_slice(&computed);
        Ok(())
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let (answer, receiver) = channel();
        self.request(jobs, Want::Outcomes(answer))?;
        receiver.recv().map_err(|_| closed())
    }
}

/// Time for which the post waits for further requests before it serves the others. Breeding a generation takes less.
const QUIET: Duration = Duration::from_millis(2);
/// Interval of progress messages while there is nothing to serve.
const LONG: Duration = Duration::from_millis(100);

/// The thread of the shared evaluator, and its requests.
pub struct Post<'a> {
    evaluator: &'a mut dyn Evaluator,
    identity: Arc<Mutex<Identity>>,
    receiver: Receiver<Message>,
    sender: Option<Sender<Message>>,
    /// Per group: active threads, and their requests.
    threads: [usize; 2],
    pending: [Vec<Request>; 2],
    /// Unfinished jobs of each group at the evaluator.
    under_way: [Vec<Request>; 2],
    groups: usize,
}

impl<'a> Post<'a> {
    /// A post for an evaluator. One that computes on a device gets two groups: the host breeds one while the device simulates the other.
    pub fn new(evaluator: &'a mut dyn Evaluator) -> Post<'a> {
        let (sender, receiver) = channel();
        let groups = if evaluator.overlaps() { 2 } else { 1 };
        let identity = Arc::new(Mutex::new(Identity::of(evaluator)));
        let (threads, [pending, under_way]) = ([0; 2], [(); 2].map(|()| [Vec::new(), Vec::new()]));
        Post { evaluator, identity, receiver, sender: Some(sender), threads, pending, under_way, groups }
    }

    /// A connection for another thread; all are created before [`Post::serve`].
    pub fn line(&mut self) -> Line {
        let total: usize = self.threads.iter().sum();
        let group = total % self.groups;
        self.threads[group] += 1;
        Line {
            group,
            to_post: self.sender.clone().expect("lines are handed out before serving"),
            gof: *self.evaluator.gof(),
            identity: Arc::clone(&self.identity),
        }
    }

    /// Serves until every thread has ended. `idle` is called from time to time.
    ///
    /// # Errors
    /// When the evaluator fails; the threads then get [`Closed`].
    pub fn serve(mut self, idle: &mut dyn FnMut()) -> Result<(), EvaluateError> {
        self.sender = None;
        let sets = [BufferSet::A, BufferSet::B];
        loop {
            let mut busy = false;
            for group in 0..self.groups {
                self.fill(group, idle);
                let other = (group + 1) % self.groups;
                if !self.pending[group].is_empty() {
                    self.submit(group, sets[group])?;
                    busy = true;
                }
                if !self.under_way[other].is_empty() {
                    self.collect(other, sets[other])?;
                    busy = true;
                }
            }
            if !busy && self.threads == [0, 0] && self.under_way.iter().all(Vec::is_empty) {
                return Ok(());
            }
        }
    }

    /// Waits until every thread of a group has sent a request or ended. Some may be busy for long, with scores that they compute
    /// themselves: after a quiet moment, it serves those that have sent one. No result depends on which threads are served together.
    fn fill(&mut self, group: usize, idle: &mut dyn FnMut()) {
        while self.pending[group].len() + self.under_way[group].len() < self.threads[group] {
            let work = self.pending.iter().chain(&self.under_way).any(|requests| !requests.is_empty());
            let heard = self.receiver.recv_timeout(if work { QUIET } else { LONG });
            idle();
            match heard {
                Ok(Message::Request(request)) => self.pending[request.group].push(request),
                Ok(Message::Gone(group)) => self.threads[group] -= 1,
                Err(_) if work => return,
                Err(_) => {}
            }
        }
    }

    fn submit(&mut self, group: usize, set: BufferSet) -> Result<(), EvaluateError> {
        let mut requests = std::mem::take(&mut self.pending[group]);
        // Other requests are answered at once.
        for request in requests.extract_if(.., |request| matches!(request.want, Want::Outcomes(_))) {
            let outcomes = self.evaluator.outcomes(&jobs(std::slice::from_ref(&request)))?;
            if let Want::Outcomes(answer) = request.want {
                let _ = answer.send(outcomes);
            }
        }
        if !requests.is_empty() {
            self.evaluator.submit(set, &jobs(&requests))?;
        }
        self.under_way[group] = requests;
        Ok(())
    }

    fn collect(&mut self, group: usize, set: BufferSet) -> Result<(), EvaluateError> {
        let requests = std::mem::take(&mut self.under_way[group]);
        let mut scores = vec![Score::Rejected; Job::candidates(&jobs(&requests))];
        self.evaluator.collect(set, &mut scores)?;
        *lock(&self.identity) = Identity::of(self.evaluator);
        let mut rest = scores.as_slice();
        for request in requests {
            let count = request.jobs.iter().map(|(_, population)| population.len()).sum();
            let (own, others) = rest.split_at(count);
            rest = others;
            if let Want::Scores(answer) = request.want {
                // A thread that no longer waits was interrupted.
                let _ = answer.send(own.to_vec());
            }
        }
        Ok(())
    }
}

fn jobs(requests: &[Request]) -> Vec<Job<'_>> {
    requests.iter().flat_map(|r| &r.jobs).map(|(case, population)| Job { case: *case, population }).collect()
}
