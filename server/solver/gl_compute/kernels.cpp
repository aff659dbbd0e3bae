#include "server/solver/gl_compute/kernels.h"

#include <spdlog/spdlog.h>

#include <array>
#include <sstream>
#include <utility>

#include "server/scene/distance_map.h"
#include "server/solver/solver_constants.h"
#include "shaders/embedded_shaders.h"

namespace drape {

namespace {

std::string ConstantDefines() {
  std::ostringstream text;
  text << std::scientific;
  text << "#define MIN_DIRECTION_LENGTH " << kMinDirectionLength_m << "\n";
  text << "#define MIN_GRADIENT " << DistanceMap::kMinGradient << "\n";
  text << "#define MIN_STRIP_PIVOT " << kMinStripPivot << "\n";
  text << "#define MIN_STRIP_PIVOT_AT_PIN " << kMinStripPivotAtPin << "\n";
  text << "#define MAX_STRIP_MOVE " << kMaxStripMove << "\n";
  text << "#define REFINE_SWEEPS " << kRefineSweeps << "u\n";
  text << "#define REACH_FACTOR " << kReachFactor << "\n";
  text << "#define REACH_DIRECTIONS " << kReachDirections << "u\n";
  text << "#define MIN_DIRECTION_COSINE " << kMinDirectionCosine << "\n";
  text << "#define MAX_SPEED " << kMaxSpeed_m_per_s << "\n";
  text << "#define MAX_AIR_RATIO " << kMaxAirRatio << "\n";
  text << "#define MAX_ELASTIC_RATIO " << kMaxElasticRatio << "\n";
  text << "#define MAX_COORDINATE " << kMaxCoordinate_m << "\n";
  return text.str();
}

// The variant as far as a kernel reads it, so that variants share what is the same for both.
KernelVariant OnlyTolerance(const KernelVariant& variant) {
  return {.local_size = variant.local_size, .has_tolerance = variant.has_tolerance};
}

KernelVariant WithSprings(KernelVariant narrowed, const KernelVariant& variant) {
  narrowed.springs = variant.springs;
  return narrowed;
}

KernelVariant WithContacts(KernelVariant narrowed, const KernelVariant& variant) {
  narrowed.has_contacts = variant.has_contacts;
  narrowed.has_capsules = variant.has_capsules;
  narrowed.has_boxes = variant.has_boxes;
  narrowed.has_distance_maps = variant.has_distance_maps;
  narrowed.has_friction = variant.has_friction;
  narrowed.has_restitution = variant.has_restitution;
  narrowed.has_moving_colliders = variant.has_moving_colliders;
  narrowed.leaves_out_colliders = variant.leaves_out_colliders;
  return narrowed;
}

}  // namespace

Result<KernelCache> KernelCache::Create(const std::string& shader_dir) {
  KernelCache cache;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    cache.library_.Add(std::string(shader.path), std::string(shader.text));
  }
  if (!shader_dir.empty()) DRAPE_RETURN_IF_ERROR(cache.library_.AddDirectory(shader_dir));
  return cache;
}

Result<const gl::Program*> KernelCache::Compile(const std::string& kernel,
                                                const std::string& defines) {
  const auto known = programs_.find({kernel, defines});
  if (known != programs_.end()) return &known->second;
  const Result<gl::ShaderSource> source =
      library_.Assemble("kernels/" + kernel + ".comp", ConstantDefines() + defines);
  if (!source.ok()) return source.status();
  Result<gl::Program> program = gl::Program::Compile(source.value());
  if (!program.ok()) return program.status();
  const auto added =
      programs_.emplace(std::pair(kernel, defines), std::move(program).value()).first;
  return &added->second;
}

Result<const gl::Program*> KernelCache::General(const std::string& kernel, uint32_t local_size) {
  return Compile(kernel, "#define LOCAL_SIZE " + std::to_string(local_size) + "\n");
}

Result<const StepKernels*> KernelCache::ForVariant(const KernelVariant& variant) {
  const auto known = variants_.find(variant);
  if (known != variants_.end()) return &known->second;
  const auto refused = refused_.find(variant);
  if (refused != refused_.end()) return refused->second;
  StepKernels kernels{.variant = variant};
  if (variant.is_tiled()) {
    DRAPE_RETURN_IF_ERROR(CompileTiled(kernels));
  } else {
    const Result<const gl::Program*> program = Compile("resident_step", variant.Defines());
    if (!program.ok()) {
      if (variant.strip_solve != StripSolve::kElimination) {
        spdlog::warn("strips_by_elimination reason=\"{}\"", program.status().message());
        refused_.emplace(variant, program.status());
      }
      return program.status();
    }
    kernels.resident_step = program.value();
  }
  return &variants_.emplace(variant, kernels).first->second;
}

Status KernelCache::CompileTiled(StepKernels& kernels) {
  const KernelVariant& all = kernels.variant;
  const KernelVariant plain{.local_size = all.local_size};
  const KernelVariant tolerance = OnlyTolerance(all);
  KernelVariant distance = tolerance;
  distance.has_compliance = all.has_compliance;
  distance.has_start_directions = all.has_start_directions;
  distance.has_strips = all.has_strips;
  distance.has_colours = all.has_colours;
  distance.has_two_steps = all.has_two_steps;
  KernelVariant timed = plain;
  timed.has_two_steps = all.has_two_steps;
  KernelVariant begin = timed;
  begin.has_refinement = all.has_refinement;
  begin.leaves_out_colliders = all.leaves_out_colliders;
  KernelVariant reach = WithContacts(plain, all);
  reach.has_friction = reach.has_restitution = false;
  KernelVariant refine = tolerance;
  refine.has_two_steps = all.has_two_steps;
  KernelVariant refine_group = refine;
  refine_group.local_size = all.refine_local_size;
  KernelVariant tether = timed;
  tether.has_start_directions = all.has_start_directions;
  distance.has_inequalities = all.has_inequalities;
  distance.has_own_lengths = all.has_own_lengths;
  KernelVariant joints = tolerance;
  joints.has_joints = all.has_joints;
  joints.has_joint_compliance = all.has_joint_compliance;
  KernelVariant strips = distance;
  strips.has_regular_strips = all.has_regular_strips;
  const KernelVariant contacts = WithContacts(tolerance, all);
  const KernelVariant with_springs = WithSprings(timed, all);
  // The rebound of a hit is found from the velocity before the substep.
  const KernelVariant predict =
      all.has_restitution ? WithContacts(with_springs, all) : with_springs;
  KernelVariant integrate = WithContacts(with_springs, all);
  integrate.has_damping = all.has_damping;
  integrate.has_velocity_stage = all.has_velocity_stage;
  KernelVariant velocity = plain;
  velocity.has_compliance = all.has_compliance;
  velocity.has_inequalities = all.has_inequalities;
  velocity.has_joints = all.has_joints;
  velocity.has_joint_compliance = all.has_joint_compliance;

  struct Wanted {
    bool is_needed;
    const char* kernel;
    KernelVariant variant;
    const gl::Program** program;
  };
  const bool has_springs = all.springs != KernelVariant::Springs::kNone;
  const bool has_kicks = all.springs == KernelVariant::Springs::kHalfKicks;
  const std::array wanted = {
      Wanted{true, "tiled_begin", begin, &kernels.tiled_begin},
      Wanted{all.leaves_out_colliders, "tiled_find_range", reach, &kernels.tiled_find_range},
      Wanted{all.leaves_out_colliders, "tiled_find_near", reach, &kernels.tiled_find_near},
      Wanted{has_springs, "tiled_spring_accelerations", timed, &kernels.tiled_spring_accelerations},
      Wanted{has_kicks, "tiled_kick", timed, &kernels.tiled_kick},
      Wanted{all.has_elastic, "tiled_elastic_impulses", timed, &kernels.tiled_elastic_impulses},
      Wanted{all.has_elastic, "tiled_apply_elastic", timed, &kernels.tiled_apply_elastic},
      Wanted{all.has_wind, "tiled_air_impulses", timed, &kernels.tiled_air_impulses},
      Wanted{all.has_wind, "tiled_apply_wind", timed, &kernels.tiled_apply_wind},
      Wanted{true, "tiled_predict", predict, &kernels.tiled_predict},
      Wanted{all.has_twist, "tiled_twist_changes", timed, &kernels.tiled_twist_changes},
      Wanted{all.has_twist, "tiled_apply_twist", timed, &kernels.tiled_apply_twist},
      Wanted{all.has_tethers, "tiled_tether", tether, &kernels.tiled_tether},
      Wanted{all.has_tolerance, "tiled_begin_sweeps", plain, &kernels.tiled_begin_sweeps},
      Wanted{all.has_strips, "tiled_solve_strips", strips, &kernels.tiled_solve_strips},
      Wanted{all.has_refinement, "tiled_test_links", refine, &kernels.tiled_test_links},
      Wanted{all.has_refinement, "tiled_collect_links", refine, &kernels.tiled_collect_links},
      Wanted{all.has_refinement, "tiled_refine", refine_group, &kernels.tiled_refine},
      Wanted{all.has_colours, "tiled_solve_distance", distance, &kernels.tiled_solve_distance},
      Wanted{all.has_joints, "tiled_solve_joints", joints, &kernels.tiled_solve_joints},
      Wanted{all.has_contacts, "tiled_solve_contacts", contacts, &kernels.tiled_solve_contacts},
      Wanted{all.has_tolerance, "tiled_end_sweep", plain, &kernels.tiled_end_sweep},
      Wanted{true, "tiled_integrate", integrate, &kernels.tiled_integrate},
      Wanted{all.has_velocity_stage, "tiled_solve_velocity", velocity,
             &kernels.tiled_solve_velocity},
      Wanted{all.has_velocity_stage, "tiled_correct_velocity", integrate,
             &kernels.tiled_correct_velocity},
      Wanted{all.has_pins, "tiled_place_pins", plain, &kernels.tiled_place_pins},
      Wanted{true, "tiled_check", plain, &kernels.tiled_check},
      Wanted{true, "tiled_commit", tolerance, &kernels.tiled_commit},
  };
  for (const Wanted& entry : wanted) {
    if (!entry.is_needed) continue;
    const Result<const gl::Program*> program = Compile(entry.kernel, entry.variant.Defines());
    if (!program.ok()) return program.status();
    *entry.program = program.value();
  }
  return Status::Ok();
}

}  // namespace drape
