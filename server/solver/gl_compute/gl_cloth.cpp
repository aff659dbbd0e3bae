#include "server/solver/gl_compute/gl_cloth.h"
#include "server/solver/gl_compute/plan_on_device.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "server/solver/solver_constants.h"
#include "server/solver/substep_schedule.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint32_t FloatWord(double value) {
  return std::bit_cast<uint32_t>(static_cast<float>(value));
}

void AppendVector(const Eigen::Vector3d& v, std::vector<uint32_t>& words) {
  for (int axis = 0; axis < 3; ++axis) words.push_back(FloatWord(v[axis]));
}

// Layout: shaders/interface/bindings.h.
struct ColliderWords {
  uint32_t kind;
  double radius_m = 0;
  Eigen::Vector3d point_m;
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();  // in columns
};

ColliderWords ToWords(const SphereCollider& sphere) {
  return {.kind = DRAPE_COLLIDER_SPHERE, .radius_m = sphere.radius_m, .point_m = sphere.center_m};
}

ColliderWords ToWords(const PlaneCollider& plane) {
  return {.kind = DRAPE_COLLIDER_PLANE, .point_m = plane.point_m, .vector = plane.normal};
}

ColliderWords ToWords(const CapsuleCollider& capsule) {
  ColliderWords words{.kind = DRAPE_COLLIDER_CAPSULE,
                      .radius_m = capsule.radius_m,
                      .point_m = capsule.a_m,
                      .vector = capsule.b_m - capsule.a_m};
  words.axes.col(0) = NormalOnSegment(capsule);
  return words;
}

ColliderWords ToWords(const BoxCollider& box) {
  return {.kind = DRAPE_COLLIDER_BOX,
          .point_m = box.center_m,
          .vector = box.half_extents_m,
          .axes = box.rotation.toRotationMatrix()};
}

ColliderWords ToWords(const DistanceMapCollider& solid) {
  return {.kind = DRAPE_COLLIDER_DISTANCE_MAP,
          .point_m = solid.transform * solid.map->low_m(),
          .axes = solid.transform.rotation.toRotationMatrix()};
}

void SetSettings(const GlCloth& cloth, shader::ClothRecord& record) {
  const ClothParameters& parameters = cloth.parameters;
  const StepSettings& settings = parameters.settings;
  const double h = settings.substep_s();
  const double length_scale = cloth.model->model->length_scale_m();
  record.gravity = {static_cast<float>(parameters.gravity_m_per_s2.x()),
                    static_cast<float>(parameters.gravity_m_per_s2.y()),
                    static_cast<float>(parameters.gravity_m_per_s2.z()), 0};
  record.max_iterations = cloth.max_iterations;
  const SolverChoice solver =
      PlanOnDevice(*cloth.model->model, parameters, cloth.has_own_lengths()).solver;
  record.end_share = static_cast<float>(solver.end_share);
  record.velocity_iterations = solver.velocity_iterations;
  record.h = static_cast<float>(h);
  record.half_h = static_cast<float>(h / 2);
  record.inverse_h = static_cast<float>(1 / h);
  record.tolerance = static_cast<float>(cloth.tolerance);
  record.contact_tolerance = static_cast<float>(cloth.tolerance * length_scale);
  record.max_depenetration = static_cast<float>(kMaxDepenetrationSpeed_m_per_s * h);
  record.thickness = static_cast<float>(parameters.thickness_m);
  record.friction_static = static_cast<float>(parameters.friction_static);
  record.friction_dynamic = static_cast<float>(parameters.friction_dynamic);
  record.restitution = static_cast<float>(parameters.restitution);
  record.slowest_rebound = static_cast<float>(SlowestRebound(parameters));
  record.reach_margin = static_cast<float>(kReachMarginRatio * length_scale);
  record.contact_margin = static_cast<float>(kContactMarginRatio * length_scale);
}

// Zero unless there is a refinement.
void SetRefinement(const GlCloth& cloth, shader::ClothRecord& record) {
  const SceneModel& model = *cloth.model->model;
  const SolverChoice solver = PlanOnDevice(model, cloth.parameters, cloth.has_own_lengths()).solver;
  if (solver.refine_above_strain == 0) return;
  // Never below the tolerance that is used: a sweep that changed nothing has left nothing.
  const double limit = std::max(solver.refine_above_strain, cloth.tolerance);
  record.shortest_sq = static_cast<float>((1 - limit) * (1 - limit));
  record.longest_sq = static_cast<float>((1 + limit) * (1 + limit));
  record.refine_rounds = solver.refine_rounds;
  record.refine_solves = solver.refine_solves;
}

// The times of the three kinds of substeps: the first, the second, later ones.
void SetSchedule(const GlCloth& cloth, shader::ClothRecord& record) {
  const SubstepSchedule schedule =
      PlanOnDevice(*cloth.model->model, cloth.parameters, cloth.has_own_lengths()).schedule;
  const double damping_per_s = cloth.parameters.damping_per_s;
  record.substeps = schedule.size();
  float* const intervals[] = {&record.intervals.x, &record.intervals.y, &record.intervals.z};
  float* const inverses[] = {&record.inverse_intervals.x, &record.inverse_intervals.y,
                             &record.inverse_intervals.z};
  float* const dampings[] = {&record.damping_factors.x, &record.damping_factors.y,
                             &record.damping_factors.z};
  float* const durations[] = {&record.inverse_durations.x, &record.inverse_durations.y,
                              &record.inverse_durations.z};
  for (uint32_t kind = 0; kind < 3; ++kind) {
    const Substep substep = schedule[std::min(kind, schedule.size() - 1)];
    const double h = substep.interval_s;
    *intervals[kind] = static_cast<float>(h);
    *inverses[kind] = static_cast<float>(1 / h);
    *dampings[kind] = static_cast<float>(substep.is_two_step ? 1 / (1 + damping_per_s * h)
                                                             : std::exp(-damping_per_s * h));
    *durations[kind] = static_cast<float>(1 / substep.duration_s);
  }
  const Substep last = schedule[schedule.size() - 1];
  record.first_kick = static_cast<float>(schedule[0].kick_before_s);
  record.last_inverse_interval = static_cast<float>(1 / last.interval_s);
  record.twist_share = static_cast<float>(last.twist_share);
  record.twist_period = schedule.twist_period();
}

// Zero unless there are air forces.
void SetAir(const GlCloth& cloth, shader::ClothRecord& record) {
  const SceneModel& model = *cloth.model->model;
  const ModelLayout& layout = cloth.model->layout;
  const ClothParameters& parameters = cloth.parameters;
  if (!HasAirForces(model, parameters)) return;
  const Eigen::Vector3f wind = parameters.wind_m_per_s.cast<float>();
  record.wind = {wind.x(), wind.y(), wind.z(), 0};
  record.triangle_count = static_cast<uint32_t>(model.triangles().size());
  record.air_drag = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_drag / 4);
  record.air_lift = static_cast<float>(kAirDensity_kg_per_m3 * parameters.air_lift / 4);
  const uint32_t begin = cloth.model->words.begin();
  record.triangles = begin + layout.triangles;
  record.triangle_masses = begin + layout.triangle_masses;
  record.triangle_offsets = begin + layout.triangle_offsets;
  record.particle_triangles = begin + layout.particle_triangles;
}

void SetModel(const GlCloth& cloth, shader::ClothRecord& record) {
  const SceneModel& model = *cloth.model->model;
  const ModelLayout& layout = cloth.model->layout;
  const uint32_t begin = cloth.model->words.begin();
  record.particle_count = model.particle_count();
  record.constraint_count = model.constraint_count();
  record.colour_count = model.colour_count();
  record.pin_count = model.pin_count();
  record.has_springs = model.spring_count() > 0 ? 1 : 0;
  record.has_compliance = model.has_compliance() ? 1 : 0;
  record.is_tiled = IsResident(model) ? 0 : 1;
  record.colour_offsets = begin + layout.colour_offsets;
  record.pairs = begin + layout.pairs;
  record.rest_lengths = begin + layout.rest_lengths;
  record.compliances = begin + layout.compliances;
  record.masses = begin + layout.masses;
  record.inverse_masses = begin + layout.inverse_masses;
  record.spring_offsets = begin + layout.spring_offsets;
  record.spring_ends = begin + layout.spring_ends;
  record.elastic_count = model.elastic_count();
  record.elastic_elements = begin + layout.elastic_elements;
  record.elastic_offsets = begin + layout.elastic_offsets;
  record.elastic_ends = begin + layout.elastic_ends;
  record.pins = begin + layout.pins;
  record.joint_count = model.joint_count();
  record.joint_colour_count = model.joint_colour_count();
  record.has_joint_compliance = model.has_joint_compliance() ? 1 : 0;
  record.has_inequalities = model.has_inequalities() ? 1 : 0;
  record.joint_colour_offsets = begin + layout.joint_colour_offsets;
  record.joint_pairs = begin + layout.joint_pairs;
  record.joint_compliances = begin + layout.joint_compliances;
  record.kinds = begin + layout.kinds;
  record.tether_offsets = begin + layout.tether_offsets;
  record.tethers = begin + layout.tethers;
  record.grid_columns = model.grid_columns();
  record.grid_rows = model.grid_rows();
  record.strip_phase_count = model.strips().phase_count();
  record.strip_phases = begin + layout.strip_phases;
  record.strip_offsets = begin + layout.strip_offsets;
  record.strip_constraints = begin + layout.strip_constraints;
  record.strip_particles = begin + layout.strip_particles;
  record.strip_lengths = begin + layout.strip_lengths;
  record.regular_strips = begin + layout.regular_strips;
}

}  // namespace

uint32_t MeasurePieceCount(const SceneModel& model) {
  const uint32_t longest = std::max({model.particle_count(), model.constraint_count(),
                                     model.joint_count(), model.elastic_count()});
  return (longest + DRAPE_MEASURE_PIECE - 1) / DRAPE_MEASURE_PIECE;
}

ScratchLayout LayOutScratch(const SceneModel& model, const ClothParameters& parameters,
                            bool has_work_state) {
  const uint64_t particles = model.particle_count();
  const uint64_t colliders = parameters.colliders.size();
  ScratchLayout layout;
  const auto append = [&layout](uint64_t words) {
    const uint64_t begin = layout.size;
    layout.size += words;
    return begin;
  };
  const bool has_lambdas = model.has_compliance() || model.has_inequalities();
  layout.lambdas = append(has_lambdas ? model.constraint_count() : 0);
  layout.joint_lambdas = append(model.has_joint_compliance() ? 3 * model.joint_count() : 0);
  layout.normal_betas = append(colliders * particles);
  layout.tangent_betas = append(parameters.friction_static > 0 ? 3 * colliders * particles : 0);
  layout.rebounds = append(HasRestitution(parameters) ? colliders * particles : 0);
  layout.violations = append(colliders > 0 ? particles : 0);
  layout.met_colliders = append(colliders > 0 ? particles : 0);
  layout.spring_accelerations = append(model.spring_count() > 0 ? 3 * particles : 0);
  layout.elastic_impulses = append(uint64_t{3} * model.elastic_count());
  layout.air_impulses = append(HasAirForces(model, parameters) ? 3 * model.triangles().size() : 0);
  // Those that rest lengths of its own would switch off are counted too.
  const SolverChoice solver = PlanOnDevice(model, parameters, false).solver;
  layout.previous_positions = append(solver.has_two_steps ? 3 * particles : 0);
  layout.previous_velocities = append(solver.has_two_steps ? 3 * particles : 0);
  layout.twist_changes = append(HasTwistDamping(model, parameters.settings) ? 3 * particles : 0);
  layout.strip_links =
      append(solver.has_strips ? uint64_t{DRAPE_STRIP_LINK_WORDS} * model.constraint_count() : 0);
  const bool has_links_to_refine = solver.refine_above_strain > 0 && !IsResident(model);
  layout.far_off_flags =
      append(has_links_to_refine ? particles + 2 + uint64_t{model.colour_count()} : 0);
  layout.refined_links = append(has_links_to_refine ? model.constraint_count() : 0);
  layout.work_positions = append(has_work_state ? 3 * particles : 0);
  layout.work_velocities = append(has_work_state ? 3 * particles : 0);
  const uint64_t pieces = MeasurePieceCount(model);
  layout.measured_pieces = append(pieces > 1 ? DRAPE_MEASURED_WORDS * pieces : 0);
  return layout;
}

shader::ClothRecord MakeClothRecord(const GlCloth& cloth) {
  shader::ClothRecord record{};
  SetSettings(cloth, record);
  SetSchedule(cloth, record);
  SetModel(cloth, record);
  SetRefinement(cloth, record);
  SetAir(cloth, record);
  record.positions = cloth.state.begin();
  record.velocities = cloth.state.begin() + 3 * cloth.particle_count();
  record.collider_count = static_cast<uint32_t>(cloth.parameters.colliders.size());
  record.pin_targets = cloth.parameter_words.begin();
  record.colliders = cloth.parameter_words.begin() + 3 * cloth.pin_count();
  if (HasMovingColliders(cloth.parameters)) {
    record.collider_motions =
        cloth.parameter_words.begin() + MotionsOffset(*cloth.model->model, cloth.parameters);
  }
  if (cloth.has_own_lengths()) {
    record.has_own_lengths = 1;
    record.length_starts =
        cloth.parameter_words.begin() + LengthsOffset(*cloth.model->model, cloth.parameters);
    record.length_targets = record.length_starts + record.constraint_count;
  }
  const ScratchLayout layout =
      LayOutScratch(*cloth.model->model, cloth.parameters, cloth.has_work_state());
  const auto scratch = [&cloth](uint64_t word) {
    return static_cast<uint32_t>(cloth.scratch.begin() + word);
  };
  record.lambdas = scratch(layout.lambdas);
  record.joint_lambdas = scratch(layout.joint_lambdas);
  record.normal_betas = scratch(layout.normal_betas);
  record.tangent_betas = scratch(layout.tangent_betas);
  record.rebounds = scratch(layout.rebounds);
  record.violations = scratch(layout.violations);
  record.met_colliders = scratch(layout.met_colliders);
  record.spring_accelerations = scratch(layout.spring_accelerations);
  record.elastic_impulses = scratch(layout.elastic_impulses);
  record.air_impulses = scratch(layout.air_impulses);
  record.previous_positions = scratch(layout.previous_positions);
  record.previous_velocities = scratch(layout.previous_velocities);
  record.twist_changes = scratch(layout.twist_changes);
  record.strip_links = scratch(layout.strip_links);
  record.far_off_flags = scratch(layout.far_off_flags);
  record.refined_links = scratch(layout.refined_links);
  record.work_positions = scratch(layout.work_positions);
  record.work_velocities = scratch(layout.work_velocities);
  record.measured_pieces = scratch(layout.measured_pieces);
  record.measure_piece_count = MeasurePieceCount(*cloth.model->model);
  if (cloth.kernels->variant.is_in_parts) {
    // Each is below the budget, which is a 32-bit number.
    record.sweep_cost = static_cast<uint32_t>(cloth.costs.sweep);
    record.substep_cost = static_cast<uint32_t>(cloth.costs.substep);
    record.fixed_cost = static_cast<uint32_t>(cloth.costs.fixed);
  }
  return record;
}

uint32_t MotionsOffset(const SceneModel& model, const ClothParameters& parameters) {
  return 3 * model.pin_count() +
         DRAPE_COLLIDER_WORDS * static_cast<uint32_t>(parameters.colliders.size());
}

uint32_t LengthsOffset(const SceneModel& model, const ClothParameters& parameters) {
  return MotionsOffset(model, parameters) +
         DRAPE_COLLIDER_MOTION_WORDS * static_cast<uint32_t>(parameters.collider_motions.size());
}

uint64_t ParameterWordCount(const SceneModel& model, const ClothParameters& parameters,
                            bool has_own_lengths) {
  return uint64_t{LengthsOffset(model, parameters)} +
         (has_own_lengths ? 2 * uint64_t{model.constraint_count()} : 0);
}

std::vector<uint32_t> PackLengths(std::span<const double> rest_lengths_m) {
  std::vector<uint32_t> words;
  for (const double length : rest_lengths_m) words.push_back(FloatWord(length));
  return words;
}

std::vector<uint32_t> PackTargets(std::span<const Eigen::Vector3d> targets_m) {
  std::vector<uint32_t> words;
  for (const Eigen::Vector3d& target : targets_m) AppendVector(target, words);
  return words;
}

std::vector<uint32_t> PackColliders(std::span<const Collider> colliders,
                                    std::span<const std::shared_ptr<const DeviceMap>> maps) {
  std::vector<uint32_t> words;
  size_t map_count = 0;
  for (const Collider& collider : colliders) {
    const ColliderWords packed =
        std::visit([](const auto& shape) { return ToWords(shape); }, collider);
    words.push_back(packed.kind);
    words.push_back(FloatWord(packed.radius_m));
    AppendVector(packed.point_m, words);
    AppendVector(packed.vector, words);
    for (int k = 0; k < 3; ++k) AppendVector(packed.axes.col(k), words);
    const bool is_map = packed.kind == DRAPE_COLLIDER_DISTANCE_MAP;
    words.push_back(is_map ? maps[map_count++]->words.begin() : 0);
  }
  return words;
}

std::vector<uint32_t> PackMotions(std::span<const RigidMotion> motions, double substep_s) {
  std::vector<uint32_t> words;
  for (const RigidMotion& motion : motions) {
    const double rate = motion.angular_velocity_rad_per_s.norm();
    const Eigen::Matrix3d rotation = motion.rotation.toRotationMatrix();
    const ChordFactors chord = motion.ChordOver(substep_s);
    AppendVector(motion.pivot_m, words);
    AppendVector(motion.position_m, words);
    for (int k = 0; k < 3; ++k) AppendVector(rotation.col(k), words);
    AppendVector(motion.velocity_m_per_s, words);
    const Eigen::Vector3d axis = motion.angular_velocity_rad_per_s / (rate > 0 ? rate : 1);
    AppendVector(axis, words);
    AppendVector(motion.angular_velocity_rad_per_s, words);
    words.push_back(FloatWord(rate / (2 * std::numbers::pi)));
    words.push_back(FloatWord(chord.sine));
    words.push_back(FloatWord(chord.cosine_s));
  }
  return words;
}

std::vector<float> PackState(const ParticleState& state) {
  std::vector<float> packed;
  packed.reserve(3 * (state.positions_m.size() + state.velocities_m_per_s.size()));
  for (const auto* vectors : {&state.positions_m, &state.velocities_m_per_s}) {
    for (const Eigen::Vector3d& v : *vectors) {
      for (int axis = 0; axis < 3; ++axis) packed.push_back(static_cast<float>(v[axis]));
    }
  }
  return packed;
}

std::vector<Eigen::Vector3d> PinPositions(const SceneModel& model, const ParticleState& state) {
  std::vector<Eigen::Vector3d> positions;
  for (const uint32_t pin : model.pins()) positions.push_back(state.positions_m[pin]);
  return positions;
}

}  // namespace drape
