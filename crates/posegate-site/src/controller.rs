//! The motion controller that decides on the site's tables.

use super::error::SiteError;
use super::keys;
use super::reader::Node;

/// A processor core for which the cost of a decision is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// Armv7E-M with single-precision floats; M7 and M33 take no more instructions.
    CortexM4F,
    /// Armv6-M: products of 32 bits, no divider.
    CortexM0Plus,
    /// RISC-V with products and compressed instructions.
    Rv32Imc,
}

impl Core {
    /// Every core, by its name in a site file.
    pub const ALL: [Self; 3] = [Self::CortexM4F, Self::CortexM0Plus, Self::Rv32Imc];

    /// Returns the name of the core in a site file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::CortexM4F => "cortex-m4f",
            Self::CortexM0Plus => "cortex-m0plus",
            Self::Rv32Imc => "rv32imc",
        }
    }
}

/// The level of optimization of the archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// 3: fast.
    Fast,
    /// "s": small.
    Small,
}

impl Level {
    /// Both levels.
    pub const ALL: [Self; 2] = [Self::Fast, Self::Small];

    /// Returns the name of the level in a site file, as compilers have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fast => "3",
            Self::Small => "s",
        }
    }
}

/// The cycles that the motion controller can spend on a step of the gate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// The core.
    pub core: Core,
    /// The processor cycles of one control cycle that a step of the gate may take.
    pub cycles_per_decision: u32,
    /// The cycles of an instruction on average, wait states of the flash included: at least 1.
    /// [`Self::DEFAULT_CYCLES_PER_INSTRUCTION`] if the file does not state them.
    pub cycles_per_instruction: Option<f64>,
    /// The level of optimization of its archive.
    pub level: Level,
    /// Fixes are carried along odometry.
    pub has_tracker: bool,
}

impl Controller {
    /// The cycles of an instruction if a site file gives none.
    pub const DEFAULT_CYCLES_PER_INSTRUCTION: f64 = 2.0;

    /// Returns the cycles of some instructions.
    #[must_use]
    pub fn cycles(&self, instructions: u64) -> f64 {
        let each = self.cycles_per_instruction;
        instructions as f64 * each.unwrap_or(Self::DEFAULT_CYCLES_PER_INSTRUCTION)
    }
}

pub(super) fn controller(node: &Node<'_>) -> Result<Controller, SiteError> {
    let table = node.table(&[
        &keys::CORE,
        &keys::CYCLES_PER_DECISION,
        &keys::CYCLES_PER_INSTRUCTION,
        &keys::LEVEL,
        &keys::TRACKER,
    ])?;
    let core = table
        .required(&keys::CORE)?
        .among(Core::ALL.map(|core| (core.name(), core)))?;
    let level = match table.optional(&keys::LEVEL) {
        None => Level::Fast,
        Some(node) => node.among(Level::ALL.map(|level| (level.name(), level)))?,
    };
    let has_tracker = match table.optional(&keys::TRACKER) {
        None => false,
        Some(node) => match node.written() {
            "true" => true,
            "false" => false,
            _ => return Err(node.out_of_range()),
        },
    };
    let cycles = table.required(&keys::CYCLES_PER_DECISION)?;
    Ok(Controller {
        core,
        cycles_per_decision: cycles.whole(1..=u32::MAX)?,
        cycles_per_instruction: table
            .optional(&keys::CYCLES_PER_INSTRUCTION)
            .map(|node| node.number())
            .transpose()?,
        level,
        has_tracker,
    })
}
