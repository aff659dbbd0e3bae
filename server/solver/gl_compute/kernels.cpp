#include "server/solver/gl_compute/kernels.h"

#include <spdlog/spdlog.h>

#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>

#include "server/scene/distance_map.h"
#include "server/scene/elastic_elements.h"
#include "server/solver/self_contact/pair_search.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/solver_constants.h"
#include "server/solver/strain_bins.h"
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
  const double round_off = std::numeric_limits<float>::epsilon() / 2;
  // Sums of three squares and products of rounded lengths are off by fewer than 8 roundings.
  text << std::setprecision(9) << "#define SLACK_RATIO_SQ " << 1 + 8 * round_off
       << std::setprecision(6) << "\n";
  text << "#define TOUCH_ROUND_OFF " << kTouchRoundOffs * round_off << "\n";
  text << "#define QUIET_ROUND_OFF " << kQuietRoundOffs * round_off << "\n";
  text << "#define GRAZING_SINE " << kGrazingSine << "\n";
  text << "#define LANDING_SUBSTEPS " << kLandingSubsteps << "\n";
  text << "#define SLIP_SUBSTEPS " << kSlipSubsteps << "\n";
  text << "#define SLIP_SPEED " << kSlipSpeed_m_per_s << "\n";
  text << "#define SLIP_ROUND_OFF " << kSlipRoundOffs * round_off << "\n";
  text << "#define SLIP_DOUBT " << kSlipDoubt << "\n";
  text << "#define EDGE_SHARE " << self_contact::kEdgeShare << "\n";
  text << "#define REST_SHARE " << self_contact::kRestShare << "\n";
  text << "#define CORE_SHARE " << self_contact::kCoreShare << "\n";
  text << "#define HARD_HIT " << self_contact::kHardHit << "\n";
  text << "#define HIT_SWEEPS " << self_contact::kHitSweeps << "u\n";
  text << "#define MAX_SPEED " << kMaxSpeed_m_per_s << "\n";
  text << "#define MAX_ENERGY_GAIN " << kMaxEnergyGain << "\n";
  text << "#define MAX_AIR_RATIO " << kMaxAirRatio << "\n";
  text << "#define MAX_ELASTIC_RATIO " << kMaxElasticRatio << "\n";
  text << "#define HINGE_BLUR_SQ " << kHingeBlurSq << "\n";
  text << std::setprecision(9) << "#define HINGE_NORMAL_SCALE " << kHingeNormalScale
       << std::setprecision(6) << "\n";
  text << "#define LEAST_HINGE_AREA " << kLeastHingeArea_m4 << "\n";
  text << "#define MAX_COORDINATE " << kMaxCoordinate_m << "\n";
  text << "#define STRAIN_BINS " << kStrainBins << "u\n";
  text << "#define FIRST_STRAIN_KEY " << kFirstStrainKey << "u\n";
  text << "#define STRAIN_KEY_SHIFT " << kStrainKeyShift << "\n";
  for (size_t k = 0; k < kShapeNames.size(); ++k) {
    text << "#define COLLIDER_" << UpperCase(kShapeNames[k]) << " " << k << "u\n";
  }
  return text.str();
}

using enum StepStage;
using enum Feature;
using Kernels = StepKernels;

constexpr TraitSet kShapeTraits = TraitSet::OfAllShapes() | TraitSet{kMovingColliders};
constexpr TraitSet kColliderTraits = kShapeTraits | TraitSet{kColliderReach};
constexpr TraitSet kContactTraits =
    kColliderTraits | TraitSet{kSolveContacts, kFriction, kTwoFrictions, kRestitution};

constexpr TiledKernel kTiledKernels[] = {
    {"tiled_begin",
     {kPredict},
     {kTwoSteps, kRemainders, kRefine, kColliderReach, kFindSelfContacts},
     &Kernels::tiled_begin},
    {"tiled_find_range", {kColliderReach}, kColliderTraits, &Kernels::tiled_find_range},
    {"tiled_find_near", {kColliderReach}, kColliderTraits, &Kernels::tiled_find_near},
    {"tiled_spring_accelerations",
     {kApplySprings, kSpringForces},
     {kTwoSteps, kSpringForces, kImpulses},
     &Kernels::tiled_spring_accelerations},
    {"tiled_apply_springs", {kApplySprings}, {}, &Kernels::tiled_apply_springs},
    {"tiled_elastic_impulses",
     {kApplyElastic},
     {kTwoSteps, kHingeAngles},
     &Kernels::tiled_elastic_impulses},
    {"tiled_apply_elastic", {kApplyElastic}, {kImpulses}, &Kernels::tiled_apply_elastic},
    {"tiled_air_impulses", {kApplyWind}, {kTwoSteps}, &Kernels::tiled_air_impulses},
    {"tiled_apply_wind", {kApplyWind}, {kImpulses}, &Kernels::tiled_apply_wind},
    {"tiled_predict",
     {kPredict},
     kContactTraits |
         TraitSet{kTwoSteps, kRemainders, kSpringForces, kQuietLinks, kDamping, kImpulses},
     &Kernels::tiled_predict},
    {"tiled_solve_elastic", {kSolveElastic}, {kTwoSteps, kImpulses}, &Kernels::tiled_solve_elastic},
    {"tiled_apply_cells", {kSolveElastic}, {kImpulses}, &Kernels::tiled_apply_cells},
    {"tiled_hinge_impulses",
     {kSolveHinges},
     {kTwoSteps, kSolveHinges, kHingeAngles},
     &Kernels::tiled_hinge_impulses},
    {"tiled_solve_hinges",
     {kSolveHinges},
     {kTwoSteps, kSolveHinges, kImpulses},
     &Kernels::tiled_solve_hinges},
    {"tiled_twist_changes", {kDampTwist}, {}, &Kernels::tiled_twist_changes},
    {"tiled_damp_twist", {kDampTwist}, {kImpulses}, &Kernels::tiled_damp_twist},
    {"tiled_tether", {kTether}, {kStartDirections, kImpulses}, &Kernels::tiled_tether},
    {.file = "tiled_find_self_contacts",
     .needed_by = {kFindSelfContacts},
     .reads = {kTwoSteps},
     .program = &Kernels::tiled_find_self_contacts,
     .local_size = &KernelVariant::contact_local_size},
    {"tiled_begin_sweeps", {kTolerance}, {}, &Kernels::tiled_begin_sweeps},
    {.file = "tiled_solve_strips",
     .needed_by = {kSolveStrips},
     .reads = {kTwoSteps, kTolerance, kCompliance, kStartDirections, kRegularStrips, kSpansThatGive,
               kQuietLinks, kSolveSelfContacts, kPins, kImpulses},
     .program = &Kernels::tiled_solve_strips,
     .local_size = &KernelVariant::strip_local_size},
    {"tiled_test_links", {kRefine}, {kTolerance}, &Kernels::tiled_test_links},
    {"tiled_collect_links", {kRefine}, {kTolerance}, &Kernels::tiled_collect_links},
    {.file = "tiled_refine",
     .needed_by = {kRefine},
     .reads = {kTolerance},
     .program = &Kernels::tiled_refine,
     .local_size = &KernelVariant::refine_local_size},
    {"tiled_solve_distance",
     {kSolveDistance},
     {kTolerance, kCompliance, kInequalities, kOwnLengths, kStartDirections, kSolveSelfContacts,
      kImpulses},
     &Kernels::tiled_solve_distance},
    {"tiled_solve_joints",
     {kSolveJoints},
     {kSolveJoints, kTolerance, kJointCompliance, kSolveSelfContacts, kImpulses},
     &Kernels::tiled_solve_joints},
    {.file = "tiled_solve_self_contacts",
     .needed_by = {kSolveSelfContacts},
     .reads = {kTwoSteps, kTolerance, kSolveSelfContacts, kImpulses},
     .program = &Kernels::tiled_solve_self_contacts,
     .local_size = &KernelVariant::contact_local_size},
    {"tiled_solve_contacts",
     {kSolveContacts},
     kColliderTraits | TraitSet{kTwoSteps, kTolerance, kFriction, kTwoFrictions, kRestitution,
                                kSolveSelfContacts, kImpulses},
     &Kernels::tiled_solve_contacts},
    {"tiled_end_sweep", {kTolerance}, {kSolveSelfContacts}, &Kernels::tiled_end_sweep},
    {"tiled_integrate",
     {kIntegrate},
     kContactTraits | TraitSet{kTwoSteps, kRemainders, kSpringForces, kDamping, kSolveVelocity,
                               kGuardSelfContacts, kImpulses},
     &Kernels::tiled_integrate},
    {.file = "tiled_guard_self_contacts",
     .needed_by = {kGuardSelfContacts},
     .reads = {kTwoSteps, kImpulses},
     .program = &Kernels::tiled_guard_self_contacts,
     .local_size = &KernelVariant::contact_local_size},
    {"tiled_solve_velocity",
     {kSolveVelocity},
     {kSolveJoints, kCompliance, kInequalities, kJointCompliance, kImpulses},
     &Kernels::tiled_solve_velocity},
    {"tiled_correct_velocity",
     {kSolveVelocity, kGuardSelfContacts},
     kContactTraits | TraitSet{kTwoSteps, kDamping, kImpulses},
     &Kernels::tiled_correct_velocity},
    {"tiled_place_pins", {kPins}, {}, &Kernels::tiled_place_pins},
    {"tiled_watch_energy",
     {kEnergyWatch},
     {kPins, kCompliance, kJointCompliance, kApplyElastic, kSolveElastic, kSolveHinges},
     &Kernels::tiled_watch_energy},
    {"tiled_check", {kCommit}, {}, &Kernels::tiled_check},
    {"tiled_commit",
     {kCommit},
     {kTolerance, kEnergyWatch, kSolveSelfContacts},
     &Kernels::tiled_commit},
};

// The part of the variant that the kernel depends on, so that variants share programs.
KernelVariant Narrowed(const KernelVariant& variant, const TiledKernel& kernel) {
  TraitSet reads = kernel.reads | TraitSet{kGrips};  // whoever reads an inverse mass
  KernelVariant narrowed{.local_size = variant.*kernel.local_size,
                         .traits = variant.traits & reads};
  if (kernel.local_size == &KernelVariant::strip_local_size) {
    narrowed.strip_solve = variant.strip_solve;
  }
  if (kernel.local_size == &KernelVariant::contact_local_size) {
    narrowed.contact_loop_budget = variant.contact_loop_budget;
  }
  return narrowed;
}

}  // namespace

std::span<const TiledKernel> TiledKernels() {
  return kTiledKernels;
}

std::string DefinesOf(const TiledKernel& kernel, const KernelVariant& variant) {
  return Narrowed(variant, kernel).Defines();
}

Result<gl::ShaderLibrary> OpenShaders(const std::string& shader_dir) {
  gl::ShaderLibrary library;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    library.Add(std::string(shader.path), std::string(shader.text));
  }
  if (!shader_dir.empty()) DRAPE_RETURN_IF_ERROR(library.AddDirectory(shader_dir));
  return library;
}

Result<gl::ShaderSource> AssembleKernel(const gl::ShaderLibrary& library, const std::string& kernel,
                                        const std::string& defines) {
  return library.Assemble("kernels/" + kernel + ".comp", ConstantDefines() + defines);
}

Result<std::unique_ptr<KernelCache>> KernelCache::Create(const std::string& shader_dir,
                                                         const std::string& device_defines,
                                                         std::unique_ptr<gl::ProgramStore> store) {
  Result<gl::ShaderLibrary> library = OpenShaders(shader_dir);
  if (!library.ok()) return library.status();
  std::unique_ptr<KernelCache> cache(new KernelCache);  // the constructor is private
  cache->library_ = std::move(library).value();
  cache->device_defines_ = device_defines;
  cache->store_ = std::move(store);
  return cache;
}

Result<const gl::Program*> KernelCache::Compile(const std::string& kernel,
                                                const std::string& defines) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = programs_.find({kernel, defines});
    if (known != programs_.end()) return &known->second;
  }
  const Result<gl::ShaderSource> source =
      AssembleKernel(library_, kernel, device_defines_ + defines);
  if (!source.ok()) return source.status();
  Result<gl::Program> program = gl::Program::Compile(source.value(), store_.get());
  if (!program.ok()) return program.status();
  glFinish();  // other contexts may use a program once its linking is over
  // Two threads may have compiled the same: the first one stays.
  const std::lock_guard lock(mutex_);
  const auto added =
      programs_.emplace(std::pair(kernel, defines), std::move(program).value()).first;
  return &added->second;
}

Result<const gl::Program*> KernelCache::General(const std::string& kernel, uint32_t local_size) {
  return Compile(kernel, "#define LOCAL_SIZE " + std::to_string(local_size) + "\n" +
                             TraitSet::OfAllShapes().Defines());
}

std::optional<Result<const StepKernels*>> KernelCache::Known(const KernelVariant& variant) const {
  const std::lock_guard lock(mutex_);
  const auto known = variants_.find(variant);
  if (known != variants_.end()) return &known->second;
  const auto refused = refused_.find(variant);
  if (refused != refused_.end()) return refused->second;
  return std::nullopt;
}

Result<const StepKernels*> KernelCache::ForVariant(const KernelVariant& variant) {
  if (std::optional<Result<const StepKernels*>> known = Known(variant)) return std::move(*known);
  StepKernels kernels{.variant = variant};
  if (variant.is_tiled()) {
    DRAPE_RETURN_IF_ERROR(CompileTiled(kernels));
  } else {
    const Result<const gl::Program*> program = Compile("resident_step", variant.Defines());
    if (!program.ok()) {
      if (variant.strip_solve != StripSolve::kElimination) {
        spdlog::warn("strips_another_way reason=\"{}\"", program.status().message());
        const std::lock_guard lock(mutex_);
        refused_.emplace(variant, program.status());
      }
      return program.status();
    }
    kernels.resident_step = program.value();
  }
  const std::lock_guard lock(mutex_);
  return &variants_.emplace(variant, kernels).first->second;
}

Status KernelCache::CompileTiled(StepKernels& kernels) {
  for (const TiledKernel& kernel : kTiledKernels) {
    if (!kernels.variant.traits.HasAnyOf(kernel.needed_by)) continue;
    const Result<const gl::Program*> program =
        Compile(kernel.file, DefinesOf(kernel, kernels.variant));
    if (!program.ok()) return program.status();
    kernels.*kernel.program = program.value();
  }
  return Status::Ok();
}

}  // namespace drape
