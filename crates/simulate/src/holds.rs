//! Commands on their way to the drives: held from sample to sample, each drive's dead time late.

/// Every command given so far, and how far each drive is behind.
#[derive(Debug)]
pub(crate) struct Holds {
    delays: Vec<f64>,
    times: Vec<f64>,
    commands: Vec<Vec<f64>>,
    // The command that acts in each drive now.
    acting: Vec<usize>,
}

impl Holds {
    pub fn new(delays: Vec<f64>) -> Self {
        let acting = vec![0; delays.len()];
        Self { delays, times: Vec::new(), commands: Vec::new(), acting }
    }

    /// A new command at `t`.
    pub fn give(&mut self, t: f64, command: &[f64]) {
        self.times.push(t);
        self.commands.push(command.to_vec());
    }

    /// The next instant at which a given command begins to act somewhere.
    pub fn next_switch(&self) -> f64 {
        (0..self.delays.len()).map(|dof| self.switch_of(dof)).fold(f64::INFINITY, f64::min)
    }

    /// Writes what acts at `t`.
    pub fn act(&mut self, t: f64, command: &mut [f64]) {
        for dof in 0..self.delays.len() {
            while self.switch_of(dof) <= t {
                self.acting[dof] += 1;
            }
            command[dof] = self.commands[self.acting[dof]][dof];
        }
    }

    fn switch_of(&self, dof: usize) -> f64 {
        self.times.get(self.acting[dof] + 1).map_or(f64::INFINITY, |t| t + self.delays[dof])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_drive_switches_its_own_dead_time_late() {
        let mut holds = Holds::new(vec![0.0, 0.25]);
        let mut at = |t, given: Option<[f64; 2]>| {
            if let Some(command) = given {
                holds.give(t, &command);
            }
            let mut tau = [0.0; 2];
            holds.act(t, &mut tau);
            (tau, holds.next_switch())
        };
        assert_eq!(at(0.0, Some([1.0, 10.0])), ([1.0, 10.0], f64::INFINITY));
        assert_eq!(at(1.0, Some([2.0, 20.0])), ([2.0, 10.0], 1.25));
        assert_eq!(at(1.25, None), ([2.0, 20.0], f64::INFINITY));
    }
}
