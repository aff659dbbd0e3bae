// Kernel `measure_pieces`: stage measure of one piece of a cloth (DRAPE_MEASURE_PIECE particles and as many
// constraints, joints and elastic elements), from the committed state; changes nothing but reports. Work group
// x = piece, y = cloth. A cloth of one piece is finished here, others by `measure_total`. Reads States, Models,
// Parameters, Scratch (lambdas [N s], violations [m]); writes Scratch (pieces) or Statuses.
#define HAS_MOVING_COLLIDERS  // it measures cloths of all variants
#define HAS_JOINT_COMPLIANCE
#include "stages/measured.glsl"
#include "stages/collider_surface.glsl"
#include "stages/committed_link.glsl"
#include "lib/joint.glsl"
#include "lib/measure.glsl"
#include "stages/elastic_element.glsl"

layout(local_size_x = LOCAL_SIZE) in;

// From the committed state: that at the end of the step, or at its start if the cloth is faulted.
float CommittedGap(uint c, vec3 p) {
  if (cloth.has_moving_colliders == 0u) {
    return ColliderGap(LoadCollider(c), cloth.step.thickness, p).size;
  }
  return GapAtEnd(LoadSurface(c), p).size;
}

void MeasureContacts(uint i, vec3 p, inout Measured measured) {
  float smallest_gap = CommittedGap(0u, p);
  for (uint c = 1u; c < cloth.collider_count; ++c) {
    smallest_gap = min(smallest_gap, CommittedGap(c, p));
  }
  if (smallest_gap <= cloth.step.contact_margin) ++measured.contacts;
  measured.max_penetration = max(measured.max_penetration, -smallest_gap);
  measured.max_residual = max(measured.max_residual, scratch[cloth.scratch.violations + i]);
}

// Each spring is counted at the end with the smaller index.
void MeasureSprings(uint i, vec3 p, inout Measured measured) {
  uint end = models[cloth.model.spring_offsets + i + 1u];
  for (uint s = models[cloth.model.spring_offsets + i]; s < end; ++s) {
    uint word = cloth.model.spring_ends + DRAPE_SPRING_END_WORDS * s;
    if (models[word] < i) continue;
    precise vec3 d = CommittedPosition(models[word]) - p;
    precise float elongation = Length(d) - ModelFloat(word + 1u);
    measured.elastic =
        AddCompensated(measured.elastic, ElasticEnergy(ModelFloat(word + 2u), elongation));
  }
}

void MeasureParticle(uint i, inout Measured measured) {
  float mass = ModelFloat(cloth.model.masses + i);
  vec3 p = CommittedPosition(i);
  vec3 v = StateVector(cloth.velocities + 3u * i);
  measured.kinetic = AddCompensated(measured.kinetic, KineticEnergy(mass, v));
  measured.potential =
      AddCompensated(measured.potential, PotentialEnergy(mass, cloth.step.gravity.xyz, p));
  measured.lowest = min(measured.lowest, p.y);
  precise vec3 way = p - ScratchVector(cloth.scratch.start_positions + 3u * i);
  measured.motion_sq = AddCompensated(measured.motion_sq, Dot(way, way));
  if (cloth.collider_count > 0u) MeasureContacts(i, p, measured);
  if (cloth.has_springs != 0u) MeasureSprings(i, p, measured);
}

// Whether nothing moves the link or joint between two particles.
bool AreHeld(uint i, uint j) {
  if (cloth.has_grips == 0u) return false;
  return Parameter(cloth.parameters.inverse_masses + i) == 0.0 &&
         Parameter(cloth.parameters.inverse_masses + j) == 0.0;
}

// Finite per elongation: nothing times an infinite stiffness would be no number.
float CompliantEnergy(float compliance, float elongation) {
  return ElasticEnergy(min(1.0 / compliance, kLargestFloat), elongation);
}

void MeasureConstraint(uint k, inout Measured measured) {
  float inverse_interval = cloth.substeps[DRAPE_SUBSTEP_LAST].inverse_interval;
  CommittedLink link = LoadCommittedLink(k);
  precise float strain_sq = link.strain * link.strain;
  measured.max_strain = max(measured.max_strain, abs(link.strain));
  measured.strain_sq = AddCompensated(measured.strain_sq, strain_sq);
  float residual = link.elongation;
  float compliance = 0.0;
  if (cloth.has_compliance != 0u) {
    compliance = ModelFloat(cloth.model.compliances + k);
    residual = SoftenedResidual(link.elongation, compliance, inverse_interval,
                                scratch[cloth.scratch.lambdas + k]);
    if (compliance > 0.0) {
      measured.elastic =
          AddCompensated(measured.elastic, CompliantEnergy(compliance, link.violation));
    }
  }
  if (link.kind != DRAPE_KIND_EQUAL) {
    float inverse_mass_sum = ModelFloat(cloth.model.inverse_masses + link.pair.x) +
                             ModelFloat(cloth.model.inverse_masses + link.pair.y);
    residual = AdmissibleError(link.kind, residual, scratch[cloth.scratch.lambdas + k], inverse_mass_sum,
                               compliance, cloth.step.h, cloth.step.inverse_h);
  }
  if (!AreHeld(link.pair.x, link.pair.y)) {
    measured.max_residual = max(measured.max_residual, abs(residual));
  }
}

void MeasureJoint(uint k, inout Measured measured) {
  uint word = cloth.model.joint_pairs + 2u * k;
  precise vec3 d = CommittedPosition(models[word + 1u]) - CommittedPosition(models[word]);
  float error = Length(d);
  if (cloth.has_joint_compliance != 0u) {
    float compliance = ModelFloat(cloth.model.joint_compliances + k);
    vec3 lambda = ScratchVector(cloth.scratch.joint_lambdas + 3u * k);
    if (compliance > 0.0) {
      measured.elastic = AddCompensated(measured.elastic, CompliantEnergy(compliance, error));
    }
    error = Length(JointResidual(d, compliance, cloth.step.inverse_h, lambda));
  }
  if (!AreHeld(models[word], models[word + 1u])) {
    measured.max_residual = max(measured.max_residual, error);
  }
}

void MeasureElement(uint e, inout Measured measured) {
  ElasticElement element = LoadElement(e);
  uvec4 i = element.particles;
  Differences d = DifferencesFrom(CommittedPosition(i.x), CommittedPosition(i.y),
                                  CommittedPosition(i.z), CommittedPosition(i.w));
  measured.elastic = AddCompensated(
      measured.elastic, ElasticEnergy(element.mass * element.frequency_sq, ElasticDeflection(element, d)));
}

void main() {
  BatchItem item = items[first_item + gl_WorkGroupID.y];
  OpenRecord(item.cloth);
  precise float step_end = float(cloth.step.substeps) * cloth.step.h;
  substep_begin = 0.0;
  substep_end = statuses[item.status].fault != 0u ? 0.0 : step_end;
  uint piece = gl_WorkGroupID.x;
  if (piece >= cloth.measure_piece_count) return;
  uint begin = piece * DRAPE_MEASURE_PIECE + gl_LocalInvocationID.x;
  uint particle_end = min((piece + 1u) * DRAPE_MEASURE_PIECE, cloth.particle_count);
  uint constraint_end = min((piece + 1u) * DRAPE_MEASURE_PIECE, cloth.constraint_count);
  uint joint_end = min((piece + 1u) * DRAPE_MEASURE_PIECE, cloth.joint_count);
  uint elastic_end = min((piece + 1u) * DRAPE_MEASURE_PIECE, cloth.elastic_count);
  Measured measured = NothingMeasured();
  for (uint i = begin; i < particle_end; i += LOCAL_SIZE) MeasureParticle(i, measured);
  for (uint k = begin; k < constraint_end; k += LOCAL_SIZE) MeasureConstraint(k, measured);
  for (uint k = begin; k < joint_end; k += LOCAL_SIZE) MeasureJoint(k, measured);
  for (uint e = begin; e < elastic_end; e += LOCAL_SIZE) MeasureElement(e, measured);
  measured = MergeInvocations(measured);
  if (gl_LocalInvocationID.x != 0u) return;
  if (cloth.measure_piece_count == 1u) {
    StoreMeasured(item.status, measured);
  } else {
    StorePiece(piece, measured);
  }
}
