// The immutable description that all cloths of one topology share.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "server/core/interruption.h"
#include "server/core/status.h"
#include "server/scene/constraint_builder.h"
#include "server/scene/description.h"
#include "server/scene/elastic_lines.h"
#include "server/scene/start_positions.h"
#include "server/scene/strips.h"
#include "server/scene/tethers.h"
#include "server/scene/triangle_shares.h"

namespace drape {

// One end of a spring as its particle sees it: the springs of particle p are the entries
// spring_offsets[p] .. spring_offsets[p + 1] of spring_ends, in order of the spring list.
struct SpringEnd {
  uint32_t other_particle = 0;
  double rest_length_m = 0;
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
};

// Limits of one model, as the server publishes them.
struct ModelLimits {
  uint32_t max_particles = 1u << 20;
  uint32_t max_constraints = 1u << 23;  // of distance constraints, of springs, and of joints
  // Distance constraints of one particle, springs, joints, and triangles of one. Bounds the
  // colours, 2 max_degree - 1, and with them the dependent phases of a sweep: a star of a million
  // edges would occupy the device for all sessions.
  uint32_t max_degree = 1024;
};

// Finished and constant after Build; safe to share between threads. Constraints are sorted by
// colour, in a colour by their order in the description, and so are joints, which have colours of
// their own. Constraints, joints and springs between two pins are left out.
class SceneModel {
 public:
  // Checks every index, length, mass and coefficient and names the field as it stands in
  // drape.v1.ClothSpec ("grid.columns", "mesh.triangles[7]", "particles.masses_kg[3]",
  // "material.areal_density_kg_per_m2", "pins[2].particle", ...); several violations at once (at
  // most 16). Up to half a minute of the largest ones: `interruption` is asked now and then; null:
  // nobody is.
  static Result<std::shared_ptr<const SceneModel>> Build(const ModelDescription& description,
                                                         const ModelLimits& limits = {},
                                                         Interruption* interruption = nullptr);

  uint32_t particle_count() const { return static_cast<uint32_t>(masses_kg_.size()); }
  // Particles by which clients count: more than particle_count() where the repair of a mesh made
  // several vertices one particle.
  uint32_t described_particle_count() const {
    return has_merged_vertices() ? static_cast<uint32_t>(particle_of_vertex_.size())
                                 : particle_count();
  }
  bool has_merged_vertices() const { return !particle_of_vertex_.empty(); }
  // The particle that stands for the particle or vertex `described`.
  uint32_t ParticleOf(uint32_t described) const {
    return has_merged_vertices() ? particle_of_vertex_[described] : described;
  }
  // The first one that `particle` stands for.
  uint32_t DescribedOf(uint32_t particle) const {
    return has_merged_vertices() ? first_vertices_[particle] : particle;
  }
  uint32_t constraint_count() const { return static_cast<uint32_t>(constraints_.size()); }
  uint32_t colour_count() const { return static_cast<uint32_t>(colour_offsets_.size()) - 1; }
  uint32_t joint_count() const { return static_cast<uint32_t>(joints_.size()); }
  uint32_t joint_colour_count() const {
    return static_cast<uint32_t>(joint_colour_offsets_.size()) - 1;
  }
  uint32_t spring_count() const { return static_cast<uint32_t>(springs_.size()); }
  uint32_t elastic_count() const { return static_cast<uint32_t>(elastic_elements_.size()); }
  uint32_t pin_count() const { return static_cast<uint32_t>(pins_.size()); }

  std::span<const Eigen::Vector3d> rest_positions_m() const { return rest_positions_m_; }
  // The start of the cloths: rest_positions_m(), or the result of RestoreLengths where they violate
  // the lengths (NeedsRestoring).
  std::span<const Eigen::Vector3d> start_positions_m() const {
    return is_start_restored() ? start_positions_m_ : rest_positions_m_;
  }
  bool is_start_restored() const { return !start_positions_m_.empty(); }
  // Errors of rest_positions_m() and of start_positions_m().
  const LengthErrors& rest_errors() const { return rest_errors_; }
  const LengthErrors& start_errors() const { return start_errors_; }
  LengthDemands length_demands() const;
  std::span<const double> masses_kg() const { return masses_kg_; }
  // 1/m, and 0 for pins.
  std::span<const double> inverse_masses_per_kg() const { return inverse_masses_per_kg_; }
  // Sorted by colour: colour c is [colour_offsets[c], colour_offsets[c + 1]).
  std::span<const DistanceConstraint> constraints() const { return constraints_; }
  std::span<const uint32_t> colour_offsets() const { return colour_offsets_; }
  // For each of constraints() its index in the description: in the list of a particle topology, or
  // in the order in which a grid or mesh makes its constraints (constraint_builder.h).
  std::span<const uint32_t> constraint_sources() const { return constraint_sources_; }
  // Constraints of the description, those between two pins included.
  uint32_t described_constraint_count() const { return described_constraint_count_; }
  // Sorted by colour: colour c is [joint_colour_offsets[c], joint_colour_offsets[c + 1]).
  std::span<const PointJoint> joints() const { return joints_; }
  std::span<const uint32_t> joint_colour_offsets() const { return joint_colour_offsets_; }
  std::span<const Spring> springs() const { return springs_; }
  std::span<const uint32_t> spring_offsets() const { return spring_offsets_; }
  std::span<const SpringEnd> spring_ends() const { return spring_ends_; }
  // In the order of constraint_builder.h, without the elements between pins alone.
  std::span<const ElasticElement> elastic_elements() const { return elastic_elements_; }
  const ElasticShares& elastic_shares() const { return elastic_shares_; }
  // The same elements by lines; empty for everything but grids.
  const ElasticLines& elastic_lines() const { return elastic_lines_; }
  // Pinned particles, ascending; pin k's target is element k of every pin-target list.
  std::span<const uint32_t> pins() const { return pins_; }
  // The tethers of particle p are the entries tether_offsets[p] .. tether_offsets[p + 1] of
  // tethers.
  std::span<const uint32_t> tether_offsets() const { return tethers_.offsets; }
  std::span<const Tether> tethers() const { return tethers_.tethers; }
  const StripSet& strips() const { return strips_; }
  bool hangs_by_strips() const { return hangs_by_strips_; }  // HangsByStrips
  bool has_spans() const { return !spans_.empty(); }         // FindSpans
  bool IsSpan(uint32_t strip) const { return has_spans() && spans_[strip]; }
  // Size of a grid; 0 for everything else. Particle index = row * columns + column.
  uint32_t grid_columns() const { return grid_columns_; }
  uint32_t grid_rows() const { return grid_rows_; }
  std::span<const std::array<uint32_t, 3>> triangles() const { return triangles_; }
  // The triangles of particle p are the entries triangle_offsets[p] .. triangle_offsets[p + 1] of
  // particle_triangles; triangle_masses_kg and corner_shares as in TriangleShares.
  std::span<const uint32_t> triangle_offsets() const { return triangle_shares_.offsets; }
  std::span<const uint32_t> particle_triangles() const { return triangle_shares_.triangles; }
  std::span<const double> triangle_masses_kg() const { return triangle_shares_.masses_kg; }
  std::span<const double> corner_shares() const { return triangle_shares_.corner_shares; }

  bool has_compliance() const { return has_compliance_; }  // of a distance constraint
  bool has_joint_compliance() const { return has_joint_compliance_; }
  bool has_inequalities() const { return has_inequalities_; }  // constraints of another kind
  // Mean rest length of the constraints; if there are none, of the springs; else 1 m. The scale of
  // the tolerance of contacts.
  double length_scale_m() const { return length_scale_m_; }
  // Largest |coordinate| of the rest shape over the shortest rest length, >= 1: with positions of
  // relative precision u, strains below about u * resolution_ratio cannot be told apart.
  double resolution_ratio() const { return resolution_ratio_; }
  // Upper bound on the largest squared angular frequency of the springs [1/s^2], 0 without springs:
  // the largest row sum of |M^-1/2 K M^-1/2| (Gershgorin), sum over the springs k of particle i of
  // k (w_i + sqrt(w_i w_j)). Reached by a pair of equal masses, by a mass on a pin, and by long
  // chains.
  double spring_frequency_sq_bound() const { return spring_frequency_sq_bound_; }
  // Largest max(w_i, w_j) / l0 of the constraints [1/(kg m)]: times a tension, the squared
  // frequency of a link across its length.
  double link_mobility() const { return link_mobility_; }
  // Mean strain of a constraint per force that pulls it [1/N]: compliance over rest length.
  double mean_softness_per_n() const { return mean_softness_per_n_; }
  double extent_m() const { return extent_m_; }  // diagonal of the box around the rest shape
  double total_mass_kg() const { return total_mass_kg_; }  // without pins
  // The largest squared angular frequency of an elastic element [1/s^2], 0 without elements: a
  // bound on that of all of them together (ElasticShares).
  double elastic_frequency_sq_bound() const;
  // Smallest damping over stiffness of a spring with stiffness [s]; 0 without springs.
  double least_spring_damping_s() const { return least_spring_damping_s_; }
  // The largest R such that some free particle has four constraints to neighbours that are all at
  // least R times as heavy (pins: infinitely, but for those at compliant constraints, which do not
  // count); 0 if none has four. Such a particle cannot give way to its neighbours one by one, so a
  // larger R makes sweeps converge more slowly.
  double held_mass_ratio() const { return held_mass_ratio_; }
  // The largest ratio of the masses of two free particles with a constraint between them, >= 1.
  double link_mass_ratio() const { return link_mass_ratio_; }
  uint32_t dropped_triangles() const { return dropped_triangles_; }
  const MeshRepairCounts& mesh_repair() const { return mesh_repair_; }
  // Distance constraints and joints between two pins.
  uint32_t dropped_constraints() const { return dropped_constraints_; }
  // Equal content gives equal hashes; compare with SameContent before sharing.
  uint64_t content_hash() const { return content_hash_; }
  bool SameContent(const SceneModel& other) const;

 private:
  SceneModel() = default;
  // The steps of Build, in this order.
  void SetVertices(std::vector<uint32_t> particle_of_vertex);
  void SetParticles(std::vector<Eigen::Vector3d> positions_m, std::vector<double> masses_kg,
                    std::vector<uint32_t> pins);
  void SetConnections(ParticleSystem& system, Interruption* interruption);
  void SetConstraints(const std::vector<bool>& is_pin, std::vector<DistanceConstraint> constraints);
  void SetJoints(const std::vector<bool>& is_pin, std::vector<PointJoint> joints);
  void SetScales();
  void SetStart(Interruption* interruption);
  uint64_t HashContent() const;

  std::vector<uint32_t> particle_of_vertex_;  // empty: each its own
  std::vector<uint32_t> first_vertices_;      // of each particle, unless each is its own
  std::vector<Eigen::Vector3d> rest_positions_m_;
  std::vector<Eigen::Vector3d> start_positions_m_;  // empty: as rest_positions_m_
  LengthErrors rest_errors_;
  LengthErrors start_errors_;
  std::vector<double> masses_kg_;
  std::vector<double> inverse_masses_per_kg_;
  std::vector<DistanceConstraint> constraints_;
  std::vector<uint32_t> constraint_sources_;
  std::vector<uint32_t> colour_offsets_;
  std::vector<PointJoint> joints_;
  std::vector<uint32_t> joint_colour_offsets_;
  std::vector<Spring> springs_;
  std::vector<uint32_t> spring_offsets_;
  std::vector<SpringEnd> spring_ends_;
  std::vector<ElasticElement> elastic_elements_;
  ElasticShares elastic_shares_;
  ElasticLines elastic_lines_;
  std::vector<uint32_t> pins_;
  TetherSet tethers_;
  StripSet strips_;
  std::vector<bool> spans_;
  uint32_t grid_columns_ = 0;
  uint32_t grid_rows_ = 0;
  std::vector<std::array<uint32_t, 3>> triangles_;
  TriangleShares triangle_shares_;
  bool has_compliance_ = false;
  bool has_joint_compliance_ = false;
  bool has_inequalities_ = false;
  bool hangs_by_strips_ = false;
  double length_scale_m_ = 1;
  double resolution_ratio_ = 1;
  double spring_frequency_sq_bound_ = 0;
  double link_mobility_ = 0;
  double total_mass_kg_ = 0;
  double extent_m_ = 0;
  double least_spring_damping_s_ = 0;
  double held_mass_ratio_ = 0;
  double link_mass_ratio_ = 1;
  double mean_softness_per_n_ = 0;
  uint32_t dropped_triangles_ = 0;
  MeshRepairCounts mesh_repair_;
  uint32_t dropped_constraints_ = 0;
  uint32_t described_constraint_count_ = 0;
  uint64_t content_hash_ = 0;
};

}  // namespace drape
