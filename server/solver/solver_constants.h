// Numbers of the method that no client sets, each with its meaning, its unit, and the harm of a
// change.
#pragma once

namespace drape {

// Most particles that a cloth may hold besides its pins (ClothParameters::max_grips): enough for
// two hands of several fingers. Each is a row of every list of held particles.
inline constexpr uint32_t kMaxGrips = 16;

// A particle that starts a substep inside a collider is moved out at most this fast [m/s], so that
// a cloth placed inside a collider is not shot out of it. Larger: violent ejection; smaller: slow
// recovery.
inline constexpr double kMaxDepenetrationSpeed_m_per_s = 1.0;

// With two steps a particle lands if it approaches faster than gravity accelerates it in
// kLandingSubsteps substeps, by more than kGrazingSine of its speed [-]: one that rests or slides
// does not. Larger: what lands gently hops by a third of its speed; smaller: rounding looks like
// landings, which are of first order.
inline constexpr double kLandingSubsteps = 2;
inline constexpr double kGrazingSine = 1e-3;

// Friction with two coefficients. A contact slides, so that the dynamic one holds it, where it slid
// faster when the substep began than static friction could stop within kSlipSubsteps substeps [-],
// or than kSlipSpeed_m_per_s. What slips more slowly keeps the static one, unless the whole cloth
// slips. Larger: what begins to slide while something of the cloth holds, or is about to stop,
// feels the static friction for longer; smaller: loads arrive link by link, and what slips first
// hands them on, so that slip spreads over what could hold it.
inline constexpr double kSlipSubsteps = 6;
inline constexpr double kSlipSpeed_m_per_s = 0.05;
// In single precision what slips is held by friction only beyond doubt: by so many roundings of its
// position in the velocity of a substep [-], but at most by this share of the limit [-]. Larger:
// the whole cloth counts as slipping where parts of it hold; smaller: rounding holds what slips as
// a whole just beyond its static friction.
inline constexpr double kSlipRoundOffs = 2;
inline constexpr double kSlipDoubt = 0.25;

// A particle touches a collider if its gap is smaller than this many roundings of the coordinates
// from which it is computed [-]: at most 11 of them add up. Larger: particles rest that much off
// the surface; smaller: rounding looks like motion, and lets go what static friction holds.
inline constexpr double kTouchRoundOffs = 16;

// The errors of links between particles that rest on colliders count from this many roundings of
// the particles' coordinates on [-]: as far as storing them before and after a substep can be off.
// Larger: such links are slack, edges over which a cloth hangs tremble, and loads run over a bar
// whose friction could hold them, since the errors are what remembers friction; smaller: rounding
// pulls particles that static friction holds.
inline constexpr double kQuietRoundOffs = 2;

// A particle that reaches a collider more slowly than gravity accelerates it in this many
// substeps does not bounce off it [-] (Müller et al. 2020, «Detailed Rigid Body Simulation with
// Extended Position Based Dynamics», section 3.6). Smaller: resting particles hop; larger: bounces
// end at a larger height.
inline constexpr double kReboundSubsteps = 2;

// Largest own velocity [m/s] and angular velocity [rad/s] of a collider: within 1/60 s that is 17 m
// and 2.7 turns, far more than any cloth follows.
inline constexpr double kMaxColliderSpeed_m_per_s = 1e3;
inline constexpr double kMaxColliderTurn_rad_per_s = 1e3;

// A particle touches a collider when its gap is at most this share of the model's length scale [-].
// Only for counting contacts in reports.
inline constexpr double kContactMarginRatio = 1e-3;

// Colliders out of reach: within a step the free particles of a cloth are expected to stay within
// this many times the way of the fastest one in free fall and of the pins [-], and this share of
// the model's length scale [-]. Results do not depend on it. Larger: colliders are tested that
// nothing touches; smaller: particles get farther, and then all colliders are tested.
inline constexpr double kReachFactor = 2;
inline constexpr double kReachMarginRatio = 0.01;
// A moving ball or capsule whose radius is below this many edge lengths of the cloth is sharp for
// it: its edges touch it, too (ColliderContact::kAuto) [-]. An edge of length l over a radius R,
// pulled taut, presses its ends at the angle l/2R against the surface, and friction mu holds them
// for ever where tan(l/2R) >= 1/mu: at R = l for mu = 1.8. Below R = 0.7 l it also slips between
// particles. Larger: cloths that need it not leave their lanes; smaller: edges are caught and torn.
inline constexpr double kSharpRadius = 1.5;
// What rests and is thinner than this many edge lengths may have come through the cloth, between
// its particles: edges would lock it there, and a cloth that is pulled would tear [-]. Larger:
// edges are caught that need not be; smaller: pulled cloths are torn by thin rods.
inline constexpr double kSlipRadius = 0.7;
// A held particle that moves more slowly holds its cloth still (collider_contact.h) [m/s].
// Larger: cloth that is drawn slowly over an edge hooks itself onto it, a centimetre in that many
// seconds; smaller: hands that hold still by control make a cloth at rest on corners tremble.
inline constexpr double kStillHold_m_per_s = 1e-3;
// Number of attempts to find a direction that separates a collider from that range [-].
inline constexpr unsigned kReachDirections = 4;

// Beyond these a state counts as blown up and the cloth is FAULTED [m/s], [m from the cloth's
// origin]. Far above any cloth in SI units; single precision still resolves 0.1 m there.
inline constexpr double kMaxSpeed_m_per_s = 1e5;
inline constexpr double kMaxCoordinate_m = 1e6;
// The same for the angular velocity of a body [rad/s]: far above a marble that rolls.
inline constexpr double kMaxTurn_rad_per_s = 1e6;

// Below this length [m] a difference of two positions has no direction: the impulse then acts along
// +x (distance constraints, i to j) or not at all (springs); contacts at a sphere's centre push
// along +y.
inline constexpr double kMinDirectionLength_m = 1e-12;

// A pivot of a strip's tridiagonal system is at least this share of its diagonal [-]; pivots are as
// small as the ratio of the masses. Smaller: rounding decides; larger: heavy particles at light
// ones are held less tightly than they could be.
inline constexpr double kMinStripPivot = 1e-5;
// The same for a link that ends at a pin. If the path also begins at a pin and is taut and
// straight, one constraint is redundant and its pivot is 0. Smaller: the rounding left in that
// pivot throws particles about; larger: rows between pins are solved less exactly.
inline constexpr double kMinStripPivotAtPin = 1e-2;
// All impulses of a strip are scaled down by one factor if they would move a particle by more than
// this many link lengths in one sweep [-]: beyond, the linearised errors mean nothing. Smaller:
// slow recovery of stretched cloths; larger: links may turn over.
inline constexpr double kMaxStripMove = 1;

// Refinement: sweeps over the links that it moves, between two searches for them [-], and the
// largest number of such rounds in a step. Fewer sweeps and more rounds give the same result, but
// searching takes time (tests/bench/notes/solver.md).
inline constexpr unsigned kRefineSweeps = 4;
inline constexpr unsigned kMaxRefineRounds = 16;
// No further round once refinement has moved this share of all links of all substeps of the step
// [-]: refining a cloth that is stretched everywhere would take as long as its substeps.
inline constexpr double kRefineShare = 1.0 / 4;

// Direction BLENDED: impulses act along the links as they were at the start of the substep where
// Gamma = h^2 T / (m L), with the whole weight of the cloth as T, is at most the first number, as
// they will be at its end from the second on [-]. Larger: start directions are unstable from about
// 1 on, and motion multiplies tensions; smaller: more cloths are solved to first order.
inline constexpr double kBlendBegin = 0.15;
inline constexpr double kBlendEnd = 0.30;
// The same for the weight over the number of pins, where links form cells: a cloth that hangs by
// few pins whips with its hem, whose cells flutter. Largest strain beside a collider that is never
// touched, start / end directions (DirectionLong in tests/physics): 24 x 24 on two corners (Gamma
// per pin 0.0067) 11 / 1.3 %, 32 x 32 (0.016) 8 of 64 fault / 3.7 %.
inline constexpr double kWhipBegin = 0.004;
inline constexpr double kWhipEnd = 0.008;
// Largest factor by which `load_limit` may multiply a cloth's substeps [-]. Larger: one session's
// heavy cloth takes the time of all sessions; smaller: heavy cloths stretch.
inline constexpr double kMaxLoadFactor = 1.8;
// The diagonals of spans, strips that pins may hold taut, grow by this many times the square of
// OwnLoadRatio [-]: about four times what keeps the tension of a taut one stable with two steps.
// Larger: spans sag and strain more; smaller: they flutter (from about 1 on two corners, 2 on
// four).
inline constexpr double kSpanGive = 4;
// From this OwnLoadRatio on [-]; below, the least pivots at pins give way far enough. Larger:
// cloths on four corners flutter (from 0.008 on); smaller: others are changed for nothing.
inline constexpr double kLeastSpanLoad = 0.006;
// An OwnLoadRatio that counts as no larger there [-]: that of the heaviest cloths that `load_limit`
// leaves to a step. Larger: spans of few substeps stretch without end; smaller: they flutter.
inline constexpr double kMostSpanLoad = 0.15;
// A link that turns farther than this within a substep, 8 degrees, has the direction of its end
// [-, cosine]: no motion of a cloth does, only flutter. Smaller: strips of links that flutter blow
// up; larger: more links are solved to first order.
inline constexpr double kMinDirectionCosine = 0.99;

// Largest h^2 omega^2 of an elastic element in the formula of its damping [-]: at this ratio only a
// trillionth of its speed is left. Larger: the square leaves single precision.
inline constexpr double kMaxElasticRatio = 1e6;
// Share of a deflection that the stages of `solve_hinges` leave, perhaps with changed sign, where
// it is too fast for the substep [-]. Larger: two steps throw such deflections back and forth (from
// 0.163 on without end); smaller: more stages.
inline constexpr double kHingeResidual = 1.0 / 7;
// Largest number of such stages [-]; stiffer hinges are softened. Each takes as long as a kick.
inline constexpr unsigned kMaxHingeStages = 32;
// Substeps share the forces of hinges where (their number h omega)^2 is no more than this [-].
// Larger: fast hinges are less exact, from 1 on some gain energy; smaller: bending costs more.
inline constexpr double kMaxSharedHingeRatio = 0.25;
// Largest number of substeps that do [-]. Larger: hardly cheaper; smaller: bending costs more.
inline constexpr unsigned kMaxHingePeriod = 4;
// Strips of meshes of compliant links look ahead by this share of a substep's interval [-]. Larger:
// what stretches and shakes within some substeps is damped more; smaller: meshes tremble.
inline constexpr double kLinkLead = 0.2;
// Grids and chains carry remainders in steps that begin with no particle faster than this [m/s].
// Larger: it costs more; smaller: what rounding shakes is faster, and does not come to rest. It
// shakes hung cloths by at most 0.02 m/s (tests/bench/notes/solver.md).
inline constexpr double kCalmSpeed_m_per_s = 0.1;
// Cloths whose SceneModel::held_mass_ratio is larger keep to one step [-]: one sweep leaves much of
// the errors there, and two steps extrapolate what is left and gain energy (from about 30 on a
// sheet whose masses alternate, `./run bench stability`). Smaller: cloths that two steps suit lose
// their second order.
inline constexpr double kMaxHeldMassRatio = 10;

// Kinetic and potential energy that a step may add for no reason, of m g l and the kinetic energy
// [-]. Larger: cloths gain that much in every step unseen; smaller: steps are done again that only
// give back what the step before took (1 to 5 % in linkages).
inline constexpr double kMaxEnergyGain = 0.05;
// The same of all steps together since nothing else has part in the energy of the cloth, of m g l
// and the kinetic energy then; and of the kinetic energy of the moment [-]. Larger: gains that each
// are small add up to that much; smaller: what two steps give back, and the rounding of long falls,
// is taken for gains.
inline constexpr double kMaxEnergyGrowth = 0.007;
inline constexpr double kMaxEnergyDrift = 0.001;
// Gravity in the scale of such gains where there is less [m/s^2]. Smaller: cloths that hardly move
// have none to be measured by.
inline constexpr double kLeastWatchedGravity_m_per_s2 = 9.81;

// With fewer substeps sweeps by colours may leave stiff links stretched by far more than their
// impulses say: then the watch of energy looks at them in every step [-]. Larger: it takes time
// where it finds nothing (a mesh in PAPER gains nothing from 8 on); smaller: gains are unseen.
inline constexpr unsigned kFewSubsteps = 8;

// Rate at which springs in the force may gain energy before a report warns [1/s]. Larger: motion
// that grows visibly has no warning; smaller: warnings although constraints and friction take the
// gain.
inline constexpr double kMaxSpringGain_per_s = 1;

// Largest strain of inextensible links that has no warning [-]. Larger: stretching that is seen has
// none; smaller: the short stretches of hems in violent motion have one.
inline constexpr double kStrainLimit = 0.05;

// Percentiles of strain in reports are rounded down to this many significant bits [-]: by less than
// a 128th. Smaller ones than the first are 0, larger ones than the second are that [-]. Finer, or
// within a wider range: the bins in which links are counted (strain_bins.h) no longer fit into the
// shared memory of a work group.
inline constexpr unsigned kPercentileBits = 8;
inline constexpr double kMinPercentile = 0x1p-24;
inline constexpr double kMaxPercentile = 254;

// Density of the air [kg/m^3]: dry, at sea level and 15 degrees Celsius (ISO 2533). Thinner air or
// water: scale the coefficients of drag and lift.
inline constexpr double kAirDensity_kg_per_m3 = 1.225;

// Largest coefficients of drag and lift [-] (a flat plate across the wind has a drag of about 1.2),
// and largest components of the wind [m/s]: far below kMaxSpeed_m_per_s, so that wind alone faults
// no cloth.
inline constexpr double kMaxAirCoefficient = 1e3;
inline constexpr double kMaxWind_m_per_s = 1e4;

// Largest effect of the air on a triangle within one kick, relative to the largest possible one
// [-]: at this ratio only a thousandth of the relative speed is left. Larger: lift on a triangle
// that the air meets squarely multiplies the rounding of the angle.
inline constexpr double kMaxAirRatio = 1e3;

}  // namespace drape
