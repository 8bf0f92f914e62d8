//! The driven plant as a system of first-order equations.

use sinew_effect::Actuation;
use sinew_plant::{Dynamics, Plant, Rates, State};

use crate::System;

/// x = [q, θ of elastic joints, q̇, θ̇ of elastic joints, z, u of drives with a lag, work of the motors], q of all that
/// has a state of its own.
pub(crate) struct Equations<'a> {
    pub dynamics: Dynamics<'a, f64>,
    /// The command that reaches each drive now, its delay behind it.
    pub command: Vec<f64>,
    /// The path from command to acting torque at the state last evaluated.
    pub actuation: Vec<Actuation<f64>>,
    pub state: State<f64>,
    pub rates: Rates<f64>,
    tau_m: Vec<f64>,
    elastic: Vec<usize>,
    lagging: Vec<usize>,
    moving: Vec<usize>,
}

impl<'a> Equations<'a> {
    /// The plant at rest at `q` and `theta`, with states of effects at zero.
    pub fn new(plant: &'a Plant, p: &[f64], q: &[f64], theta: &[f64]) -> Self {
        let nv = plant.model().nv;
        let mut dynamics = Dynamics::new(plant, p);
        let mut state = State::zero(plant);
        state.q.copy_from_slice(q);
        for dof in 0..nv {
            state.theta[dof] = if plant.elastic()[dof] { theta[dof] } else { q[dof] };
        }
        let mut actuation = vec![Actuation::default(); nv];
        dynamics.actuation(&state, &mut actuation);
        Self {
            dynamics,
            command: vec![0.0; nv],
            state,
            rates: Rates::new(plant),
            tau_m: vec![0.0; nv],
            elastic: (0..nv).filter(|&i| plant.elastic()[i]).collect(),
            lagging: (0..nv).filter(|&i| actuation[i].lag > 0.0).collect(),
            actuation,
            moving: plant.moving().to_vec(),
        }
    }

    /// The start, drives settled on their commands.
    pub fn start(&self) -> Vec<f64> {
        let mut x = vec![0.0; self.len()];
        let positions = self.moving.iter().map(|&dof| self.state.q[dof]);
        let motors = self.elastic.iter().map(|&dof| self.state.theta[dof]);
        x.iter_mut().zip(positions.chain(motors)).for_each(|(slot, at)| *slot = at);
        self.settle_drives(&mut x);
        x
    }

    /// Sets the state of lagging drives to their commands, as after a long hold.
    pub fn settle_drives(&self, x: &mut [f64]) {
        let first = self.first_lag();
        for (slot, &dof) in x[first..].iter_mut().zip(&self.lagging) {
            *slot = self.command[dof];
        }
    }

    /// Work of the motors since the start, J.
    pub fn work(&self, x: &[f64]) -> f64 {
        x[self.len() - 1]
    }

    /// Brings `state`, `rates` and `actuation` to `x`.
    pub fn evaluate(&mut self, x: &[f64]) {
        let (nv, ne) = (self.moving.len(), self.elastic.len());
        let (q, rest) = x.split_at(nv);
        let (theta, rest) = rest.split_at(ne);
        let (qd, rest) = rest.split_at(nv);
        let (thetad, rest) = rest.split_at(ne);
        let (z, rest) = rest.split_at(self.state.z.len());
        let state = &mut self.state;
        for (k, &dof) in self.moving.iter().enumerate() {
            (state.q[dof], state.theta[dof]) = (q[k], q[k]);
            (state.qd[dof], state.thetad[dof]) = (qd[k], qd[k]);
        }
        state.z.copy_from_slice(z);
        for (k, &dof) in self.elastic.iter().enumerate() {
            (state.theta[dof], state.thetad[dof]) = (theta[k], thetad[k]);
        }
        self.dynamics.actuation(state, &mut self.actuation);
        self.tau_m.copy_from_slice(&self.command);
        for (&u, &dof) in rest.iter().zip(&self.lagging) {
            self.tau_m[dof] = u;
        }
        // τ_m = (1 + κ) gain · lag(delay(command))
        for (tau, path) in self.tau_m.iter_mut().zip(&self.actuation) {
            *tau *= path.gain;
        }
        self.dynamics.add_crosstalk(&mut self.tau_m);
        self.dynamics.forward(state, &self.tau_m, &mut self.rates);
    }

    /// The robot as it stands at the state last evaluated: what sensors see.
    pub fn stands(&self) -> &State<f64> {
        self.dynamics.settled().unwrap_or(&self.state)
    }

    fn first_lag(&self) -> usize {
        2 * (self.moving.len() + self.elastic.len()) + self.state.z.len()
    }
}

impl System for Equations<'_> {
    fn len(&self) -> usize {
        self.first_lag() + self.lagging.len() + 1
    }

    fn rate(&mut self, _t: f64, x: &[f64], dx: &mut [f64]) {
        self.evaluate(x);
        let (nv, ne, lag) = (self.moving.len(), self.elastic.len(), self.first_lag());
        dx[..nv + ne].copy_from_slice(&x[nv + ne..2 * (nv + ne)]);
        for (k, &dof) in self.moving.iter().enumerate() {
            dx[nv + ne + k] = self.rates.qdd[dof];
        }
        for (k, &dof) in self.elastic.iter().enumerate() {
            dx[2 * nv + ne + k] = self.rates.thetadd[dof];
        }
        dx[2 * (nv + ne)..lag].copy_from_slice(&self.rates.zd);
        for (k, &dof) in self.lagging.iter().enumerate() {
            // u̇ = (command − u)/T
            dx[lag + k] = (self.command[dof] - x[lag + k]) / self.actuation[dof].lag;
        }
        // Ẇ = τ_mᵀ θ̇
        dx[self.len() - 1] = self.tau_m.iter().zip(&self.state.thetad).map(|(t, v)| t * v).sum();
    }
}
