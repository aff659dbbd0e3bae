#include "server/scene/scene_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "server/scene/colouring.h"
#include "server/scene/content_hash.h"
#include "server/scene/description_checks.h"

namespace drape {

namespace {

static_assert(sizeof(DistanceConstraint) == 2 * sizeof(uint32_t) + 3 * sizeof(double));
static_assert(sizeof(PointJoint) == 2 * sizeof(uint32_t) + sizeof(double));
static_assert(sizeof(Spring) == 2 * sizeof(uint32_t) + 3 * sizeof(double));
static_assert(sizeof(ElasticElement) == 4 * sizeof(uint32_t) + 7 * sizeof(double));
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));

template <class Pairs>
void EraseBetweenPins(const std::vector<bool>& is_pin, Pairs& pairs) {
  std::erase_if(pairs, [&](const auto& pair) { return is_pin[pair.i] && is_pin[pair.j]; });
}

// Moves no free particle: a hinge may have a corner whose weight is 0, opposite a right angle.
bool MovesPinsAlone(const std::vector<bool>& is_pin, const ElasticElement& element) {
  for (size_t k = 0; k < element.particles.size(); ++k) {
    if (!is_pin[element.particles[k]] && element.weights[k] != 0) return false;
  }
  return true;
}

double LeastSpringDamping_s(const std::vector<Spring>& springs) {
  double least = std::numeric_limits<double>::infinity();
  for (const Spring& spring : springs) {
    if (spring.stiffness_n_per_m == 0) continue;
    least = std::min(least, spring.damping_n_s_per_m / spring.stiffness_n_per_m);
  }
  return std::isinf(least) ? 0 : least;
}

// See SceneModel::held_mass_ratio.
double HeldMassRatio(const std::vector<DistanceConstraint>& constraints,
                     const std::vector<double>& masses_kg,
                     const std::vector<double>& inverse_masses_per_kg) {
  constexpr size_t kHeld = 4;  // more directions than a particle can move in
  // The masses of the heaviest neighbours, the heaviest first.
  std::vector<std::array<double, kHeld>> heaviest(masses_kg.size(), std::array<double, kHeld>{});
  const auto add = [&](uint32_t particle, uint32_t neighbour, bool is_compliant) {
    const bool is_pin = inverse_masses_per_kg[neighbour] == 0;
    if (is_pin && is_compliant) return;  // gives way: it does not hold the particle firmly
    double mass_kg = is_pin ? std::numeric_limits<double>::infinity() : masses_kg[neighbour];
    for (double& place : heaviest[particle]) {
      if (mass_kg > place) std::swap(mass_kg, place);
    }
  };
  for (const DistanceConstraint& constraint : constraints) {
    const bool is_compliant = constraint.compliance_m_per_n > 0;
    add(constraint.i, constraint.j, is_compliant);
    add(constraint.j, constraint.i, is_compliant);
  }
  double largest = 0;
  for (size_t i = 0; i < masses_kg.size(); ++i) {
    if (inverse_masses_per_kg[i] == 0) continue;
    largest = std::max(largest, heaviest[i][kHeld - 1] / masses_kg[i]);
  }
  return largest;
}

// The order of a stable counting sort by colour.
struct ColourOrder {
  std::vector<uint32_t> indices;  // indices of the sorted list, colour after colour
  std::vector<uint32_t> offsets;  // [colour_count + 1] where each colour begins
};

ColourOrder OrderByColour(const std::vector<uint32_t>& colours) {
  ColourOrder order;
  const uint32_t colour_count =
      colours.empty() ? 0 : *std::max_element(colours.begin(), colours.end()) + 1;
  order.offsets.assign(colour_count + size_t{1}, 0);
  for (const uint32_t colour : colours) ++order.offsets[colour + 1];
  std::partial_sum(order.offsets.begin(), order.offsets.end(), order.offsets.begin());
  order.indices.resize(colours.size());
  std::vector<uint32_t> next(order.offsets.begin(), order.offsets.end() - 1);
  for (uint32_t k = 0; k < colours.size(); ++k) order.indices[next[colours[k]]++] = k;
  return order;
}

template <class Pairs>
double MeanRestLength(const Pairs& pairs) {
  double total = 0;
  for (const auto& pair : pairs) total += pair.rest_length_m;
  return pairs.empty() ? 0 : total / static_cast<double>(pairs.size());
}

double LengthScale(const std::vector<DistanceConstraint>& constraints,
                   const std::vector<Spring>& springs) {
  if (!constraints.empty()) return MeanRestLength(constraints);
  const double mean = MeanRestLength(springs);
  return mean > 0 ? mean : 1;
}

// Springs by particle; both ends of a spring, in order of the spring list.
struct SpringEnds {
  std::vector<uint32_t> offsets;  // [particle_count + 1]
  std::vector<SpringEnd> ends;    // [2 * spring_count]
};

SpringEnds GatherSpringEnds(const std::vector<Spring>& springs, uint32_t particle_count) {
  SpringEnds gathered;
  gathered.offsets.assign(particle_count + size_t{1}, 0);
  for (const Spring& spring : springs) {
    ++gathered.offsets[spring.i + 1];
    ++gathered.offsets[spring.j + 1];
  }
  std::partial_sum(gathered.offsets.begin(), gathered.offsets.end(), gathered.offsets.begin());
  gathered.ends.resize(2 * springs.size());
  std::vector<uint32_t> next(gathered.offsets.begin(), gathered.offsets.end() - 1);
  for (const Spring& spring : springs) {
    SpringEnd end{.other_particle = spring.j,
                  .rest_length_m = spring.rest_length_m,
                  .stiffness_n_per_m = spring.stiffness_n_per_m,
                  .damping_n_s_per_m = spring.damping_n_s_per_m};
    gathered.ends[next[spring.i]++] = end;
    end.other_particle = spring.i;
    gathered.ends[next[spring.j]++] = end;
  }
  return gathered;
}

}  // namespace

Result<std::shared_ptr<const SceneModel>> SceneModel::Build(const ModelDescription& description,
                                                            const ModelLimits& limits,
                                                            Interruption* interruption) {
  auto violations = CheckDescription(description, limits);
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  ParticleSystem system = BuildParticleSystem(description.topology, description.material,
                                              description.mesh_import, interruption);
  violations = CheckLetOut(description, system.distance_constraints.size());
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  for (const LetOutLink& link : description.let_out) {
    system.distance_constraints[link.constraint].rest_length_m = link.rest_length_m;
  }
  Ask(interruption);
  violations = CheckParticleSystem(description, system, limits);
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));

  const auto model = std::shared_ptr<SceneModel>(new SceneModel());
  model->SetVertices(std::move(system.particle_of_vertex));
  model->mesh_repair_ = system.mesh_repair;
  model->SetParticles(std::move(system.rest_positions_m), std::move(system.masses_kg),
                      description.pinned_particles);
  if (const auto* grid = std::get_if<GridTopology>(&description.topology)) {
    model->grid_columns_ = grid->columns;
    model->grid_rows_ = grid->rows;
  }
  model->SetConnections(system, interruption);
  Ask(interruption);
  model->SetScales();
  model->SetStart(interruption);
  model->triangles_ = std::move(system.triangles);
  model->triangle_shares_ =
      ShareTriangles(model->rest_positions_m_, model->masses_kg_, model->triangles_,
                     model->grid_columns_ > 0 ? ParticleAreas::kEqual : ParticleAreas::kThirds);
  model->dropped_triangles_ = system.dropped_triangles;
  Ask(interruption);
  model->content_hash_ = model->HashContent();
  return std::shared_ptr<const SceneModel>(model);
}

void SceneModel::SetVertices(std::vector<uint32_t> particle_of_vertex) {
  particle_of_vertex_ = std::move(particle_of_vertex);
  // Particles are numbered by the first vertices that they stand for.
  for (uint32_t vertex = 0; vertex < particle_of_vertex_.size(); ++vertex) {
    if (particle_of_vertex_[vertex] == first_vertices_.size()) first_vertices_.push_back(vertex);
  }
}

void SceneModel::SetParticles(std::vector<Eigen::Vector3d> positions_m,
                              std::vector<double> masses_kg, std::vector<uint32_t> pins) {
  rest_positions_m_ = std::move(positions_m);
  masses_kg_ = std::move(masses_kg);
  pins_ = std::move(pins);
  for (uint32_t& pin : pins_) pin = ParticleOf(pin);
  std::sort(pins_.begin(), pins_.end());
  pins_.erase(std::unique(pins_.begin(), pins_.end()), pins_.end());
  inverse_masses_per_kg_.reserve(masses_kg_.size());
  for (const double mass : masses_kg_) inverse_masses_per_kg_.push_back(1 / mass);
  for (const uint32_t pin : pins_) inverse_masses_per_kg_[pin] = 0;
}

void SceneModel::SetConnections(ParticleSystem& system, Interruption* interruption) {
  std::vector<bool> is_pin(particle_count(), false);
  for (const uint32_t pin : pins_) is_pin[pin] = true;
  SetConstraints(is_pin, std::move(system.distance_constraints));
  Ask(interruption);
  SetJoints(is_pin, std::move(system.point_joints));
  Ask(interruption);
  tethers_ = FindTethers(rest_positions_m_, constraints_, joints_, pins_);
  Ask(interruption);
  strips_ = FindStrips(rest_positions_m_, constraints_, is_pin, interruption);
  Ask(interruption);
  AddWaysBack(WaysBack(strips_, constraints_, inverse_masses_per_kg_), strips_);
  Ask(interruption);
  hangs_by_strips_ = HangsByStrips(strips_, is_pin);
  spans_ = FindSpans(strips_, is_pin);
  springs_ = std::move(system.springs);
  EraseBetweenPins(is_pin, springs_);
  SpringEnds gathered = GatherSpringEnds(springs_, particle_count());
  spring_offsets_ = std::move(gathered.offsets);
  spring_ends_ = std::move(gathered.ends);
  Ask(interruption);
  elastic_elements_ = std::move(system.elastic_elements);
  std::erase_if(elastic_elements_,
                [&](const ElasticElement& element) { return MovesPinsAlone(is_pin, element); });
  StiffenAtClamps(is_pin, elastic_elements_);
  Ask(interruption);
  elastic_shares_ = ShareElasticElements(inverse_masses_per_kg_, elastic_elements_);
  Ask(interruption);
  elastic_lines_ = FindElasticLines(elastic_elements_, grid_columns_, grid_rows_);
}

void SceneModel::SetConstraints(const std::vector<bool>& is_pin,
                                std::vector<DistanceConstraint> constraints) {
  described_constraint_count_ = static_cast<uint32_t>(constraints.size());
  std::vector<uint32_t> sources;  // of the constraints that stay
  sources.reserve(constraints.size());
  for (uint32_t k = 0; k < constraints.size(); ++k) {
    if (!is_pin[constraints[k].i] || !is_pin[constraints[k].j]) sources.push_back(k);
  }
  EraseBetweenPins(is_pin, constraints);
  dropped_constraints_ += described_constraint_count_ - static_cast<uint32_t>(constraints.size());
  ColourOrder order = OrderByColour(ColourConstraints(constraints, particle_count()));
  colour_offsets_ = std::move(order.offsets);
  constraints_.reserve(constraints.size());
  constraint_sources_.reserve(constraints.size());
  for (const uint32_t k : order.indices) {
    constraints_.push_back(constraints[k]);
    constraint_sources_.push_back(sources[k]);
  }
  has_compliance_ = std::any_of(constraints_.begin(), constraints_.end(),
                                [](const auto& c) { return c.compliance_m_per_n > 0; });
  has_inequalities_ = std::any_of(constraints_.begin(), constraints_.end(),
                                  [](const auto& c) { return c.kind != ConstraintKind::kEqual; });
}

void SceneModel::SetJoints(const std::vector<bool>& is_pin, std::vector<PointJoint> joints) {
  const size_t joints_given = joints.size();
  EraseBetweenPins(is_pin, joints);
  dropped_constraints_ += static_cast<uint32_t>(joints_given - joints.size());
  ColourOrder order = OrderByColour(ColourJoints(joints, particle_count()));
  joint_colour_offsets_ = std::move(order.offsets);
  joints_.reserve(joints.size());
  for (const uint32_t k : order.indices) joints_.push_back(joints[k]);
  has_joint_compliance_ = std::any_of(joints_.begin(), joints_.end(),
                                      [](const auto& j) { return j.compliance_m_per_n > 0; });
}

void SceneModel::SetScales() {
  length_scale_m_ = LengthScale(constraints_, springs_);
  double extent = 0;
  for (const Eigen::Vector3d& p : rest_positions_m_) {
    extent = std::max(extent, p.cwiseAbs().maxCoeff());
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : rest_positions_m_) box.extend(p);
  extent_m_ = box.diagonal().norm();
  double shortest = length_scale_m_;
  for (const auto& constraint : constraints_)
    shortest = std::min(shortest, constraint.rest_length_m);
  resolution_ratio_ = std::max(extent, shortest) / shortest;

  const std::vector<double>& w = inverse_masses_per_kg_;
  for (const auto& constraint : constraints_) {
    const double largest = std::max(w[constraint.i], w[constraint.j]);
    link_mobility_ = std::max(link_mobility_, largest / constraint.rest_length_m);
    mean_softness_per_n_ += constraint.compliance_m_per_n / constraint.rest_length_m /
                            static_cast<double>(constraints_.size());
  }
  for (uint32_t i = 0; i < particle_count(); ++i) total_mass_kg_ += w[i] > 0 ? masses_kg_[i] : 0;
  for (uint32_t i = 0; i < particle_count(); ++i) {
    double row_sum = 0;
    for (uint32_t s = spring_offsets_[i]; s < spring_offsets_[i + 1]; ++s) {
      const SpringEnd& end = spring_ends_[s];
      row_sum += end.stiffness_n_per_m * (w[i] + std::sqrt(w[i] * w[end.other_particle]));
    }
    spring_frequency_sq_bound_ = std::max(spring_frequency_sq_bound_, row_sum);
  }
  least_spring_damping_s_ = LeastSpringDamping_s(springs_);
  held_mass_ratio_ = HeldMassRatio(constraints_, masses_kg_, w);
  for (const DistanceConstraint& constraint : constraints_) {
    const auto [heavy, light] = std::minmax(w[constraint.i], w[constraint.j]);
    if (heavy > 0) link_mass_ratio_ = std::max(link_mass_ratio_, light / heavy);
  }
}

LengthDemands SceneModel::length_demands() const {
  return {.inverse_masses_per_kg = inverse_masses_per_kg_,
          .constraints = constraints_,
          .constraint_sources = constraint_sources_,
          .joints = joints_,
          .length_scale_m = length_scale_m_,
          .tethers = tethers_};
}

void SceneModel::SetStart(Interruption* interruption) {
  start_errors_ = rest_errors_ = FindLengthErrors(length_demands(), rest_positions_m_);
  if (!NeedsRestoring(rest_errors_)) return;
  start_positions_m_ = rest_positions_m_;
  start_errors_ = RestoreLengths(length_demands(), start_positions_m_, interruption);
}

double SceneModel::elastic_frequency_sq_bound() const {
  const std::vector<double>& all = elastic_shares_.frequencies_sq_per_s2;
  return all.empty() ? 0 : *std::ranges::max_element(all);
}

// Every other member follows from these.
uint64_t SceneModel::HashContent() const {
  ContentHash hash;
  hash.Add(rest_positions_m_);
  hash.Add(masses_kg_);
  hash.Add(constraints_);
  hash.Add(constraint_sources_);
  hash.Add(joints_);
  hash.Add(springs_);
  if (!elastic_elements_.empty()) hash.Add(elastic_elements_);  // others keep their hashes
  hash.Add(pins_);
  hash.Add(triangles_);
  hash.AddWord(grid_columns_);
  hash.AddWord(grid_rows_);
  hash.AddWord(dropped_triangles_);
  if (has_merged_vertices()) hash.Add(particle_of_vertex_);
  hash.AddWord(dropped_constraints_);
  hash.AddWord(described_constraint_count_);
  return hash.value();
}

bool SceneModel::SameContent(const SceneModel& other) const {
  return SameBits(rest_positions_m_, other.rest_positions_m_) &&
         SameBits(particle_of_vertex_, other.particle_of_vertex_) &&
         mesh_repair_ == other.mesh_repair_ && SameBits(masses_kg_, other.masses_kg_) &&
         SameBits(constraints_, other.constraints_) &&
         SameBits(colour_offsets_, other.colour_offsets_) &&
         SameBits(constraint_sources_, other.constraint_sources_) &&
         SameBits(joints_, other.joints_) && SameBits(springs_, other.springs_) &&
         SameBits(elastic_elements_, other.elastic_elements_) && SameBits(pins_, other.pins_) &&
         SameBits(triangles_, other.triangles_) && grid_columns_ == other.grid_columns_ &&
         grid_rows_ == other.grid_rows_ && dropped_triangles_ == other.dropped_triangles_ &&
         dropped_constraints_ == other.dropped_constraints_ &&
         described_constraint_count_ == other.described_constraint_count_;
}

}  // namespace drape
