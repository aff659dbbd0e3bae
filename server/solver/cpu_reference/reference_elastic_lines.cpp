#include <vector>

#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_elastic.h"
#include "server/solver/cpu_reference/reference_stages.h"

namespace drape::reference {

using Eigen::Vector3d;

namespace {

using Entries = std::span<const ElasticEntry>;

// Inverse masses by which lines are solved: a line knows pins, but not what grips hold. What it
// would do to that is left out (server/solver/method.md, "Grips").
std::span<const double> LineMasses(const StepContext& context) {
  return context.model.inverse_masses_per_kg();
}

void Push(StepContext& context, uint32_t i, const Vector3d& change) {
  if (context.w[i] != 0) context.u[i] += change;
}

// The impulses of the rods on what is held: -(force time) dE/dp - s K x.
void PullByRods(const StepContext& context, const ElasticLine& line, Entries entries,
                const std::vector<Vector3d>& x) {
  const double s_s2 = context.plan.schedule.largest_force_interval_s2();
  const auto particle = [&](uint32_t k) { return line.first + k * line.stride; };
  for (uint32_t k = 1; k + 1 < line.count; ++k) {
    const Vector3d bend = context.PredictedDifference(particle(k), particle(k + 1)) -
                          context.PredictedDifference(particle(k - 1), particle(k));
    const Vector3d more = (x[k + 1] - x[k]) - (x[k] - x[k - 1]);
    const Vector3d impulse =
        -entries[k].elasticity * (context.substep.force_s() * bend + s_s2 * more);
    context.Pull(particle(k - 1), impulse);
    context.Pull(particle(k), -2 * impulse);
    context.Pull(particle(k + 1), impulse);
  }
}

// The change of velocity x with (M + s K) x = -(force time) dE/dp at the end of the substep.
void SolveRods(StepContext& context, const ElasticLine& line, Entries entries) {
  const auto particle = [&](uint32_t k) { return line.first + k * line.stride; };
  std::vector<Vector3d> x(line.count, Vector3d::Zero());
  for (uint32_t k = 1; k + 1 < line.count; ++k) {
    const Vector3d bend = context.PredictedDifference(particle(k), particle(k + 1)) -
                          context.PredictedDifference(particle(k - 1), particle(k));
    const Vector3d impulse = -context.substep.force_s() * entries[k].elasticity * bend;
    x[k - 1] += impulse;
    x[k] -= 2 * impulse;
    x[k + 1] += impulse;
  }
  for (uint32_t k = 0; k < line.count; ++k) {
    if (k > 0) x[k] -= entries[k - 1].to_next * x[k - 1];
    if (k > 1) x[k] -= entries[k - 2].to_second_next * x[k - 2];
  }
  for (uint32_t k = line.count; k-- > 0;) {
    x[k] *= entries[k].inverse_pivot;
    if (k + 1 < line.count) x[k] -= entries[k].to_next * x[k + 1];
    if (k + 2 < line.count) x[k] -= entries[k].to_second_next * x[k + 2];
  }
  if (context.impulses != nullptr) PullByRods(context, line, entries, x);
  for (uint32_t k = line.count; k-- > 0;) Push(context, particle(k), x[k]);
}

// A diagonal under way.
struct Link {
  Vector3d n = Vector3d::Zero();
  double inverse_pivot = 0;
  double ratio = 0;    // coupling with the next one over the pivot
  double impulse = 0;  // [N s]; during the elimination the right side over the pivot
};

// As a strip of compliant links (reference_strips.cpp) along the directions at the end.
void SolveDiagonals(StepContext& context, const ElasticLine& line, double rest_length_m,
                    Entries entries) {
  const double h = context.h;
  const std::span<const double> w = LineMasses(context);
  const auto particle = [&](uint32_t k) { return line.first + k * line.stride; };
  std::vector<Link> links(line.count - 1);
  for (uint32_t k = 0; k < links.size(); ++k) {
    const uint32_t i = particle(k), j = particle(k + 1);
    const Vector3d d = context.PredictedDifference(i, j);
    Link& link = links[k];
    link.n = DirectionOf(d);
    double pivot = w[i] + w[j] + entries[k].elasticity / (h * context.substep.force_s());
    double right_side = -(d.norm() - rest_length_m) / h;
    if (k > 0) {
      Link& before = links[k - 1];
      const double coupling = -w[i] * before.n.dot(link.n);
      before.ratio = coupling * before.inverse_pivot;
      pivot -= coupling * before.ratio;
      right_side -= coupling * before.impulse;
    }
    link.inverse_pivot = 1 / pivot;
    link.impulse = right_side / pivot;
  }
  for (uint32_t k = static_cast<uint32_t>(links.size()); k-- > 0;) {
    Link& link = links[k];
    if (k + 1 < links.size()) link.impulse -= link.ratio * links[k + 1].impulse;
    context.Pull(particle(k), -link.impulse * link.n);
    context.Pull(particle(k + 1), link.impulse * link.n);
    Push(context, particle(k), -w[particle(k)] * link.impulse * link.n);
    Push(context, particle(k + 1), w[particle(k + 1)] * link.impulse * link.n);
  }
}

// The impulses y of a row of cells with (K^-1 + s J W J^T) y = -(force time) twist.
std::vector<Vector3d> CellImpulses(const StepContext& context, const ElasticLine& line,
                                   Entries entries) {
  const uint32_t columns = context.model.grid_columns();
  std::vector<Vector3d> y(line.count - 1);
  for (uint32_t k = 0; k < y.size(); ++k) {
    const uint32_t i = line.first + k;
    const Vector3d twist = context.PredictedDifference(i + columns, i + columns + 1) -
                           context.PredictedDifference(i, i + 1);
    y[k] = -context.substep.force_s() * twist;
    if (k > 0) y[k] -= entries[k - 1].to_next * y[k - 1];
  }
  for (uint32_t k = static_cast<uint32_t>(y.size()); k-- > 0;) {
    y[k] *= entries[k].inverse_pivot;
    if (k + 1 < y.size()) y[k] -= entries[k].to_next * y[k + 1];
  }
  return y;
}

// All rows of cells from the same velocities.
void SolveCells(StepContext& context, std::span<const ElasticLine> lines, Entries entries) {
  const uint32_t columns = context.model.grid_columns();
  std::vector<Vector3d> impulses(context.u.size(), Vector3d::Zero());
  for (const ElasticLine& line : lines) {
    const std::vector<Vector3d> y =
        CellImpulses(context, line, entries.subspan(line.entry_begin, line.count));
    for (uint32_t k = 0; k < y.size(); ++k) {
      const uint32_t i = line.first + k;
      impulses[i] += y[k];
      impulses[i + 1] -= y[k];
      impulses[i + columns] -= y[k];
      impulses[i + columns + 1] += y[k];
    }
  }
  context.PullHeld(impulses);
  for (size_t i = 0; i < impulses.size(); ++i) context.u[i] += context.w[i] * impulses[i];
}

}  // namespace

// Family by family, line by line.
void SolveElastic(StepContext& context) {
  if (!context.plan.Has(StepStage::kSolveElastic)) return;
  const ElasticLines& elastic = context.model.elastic_lines();
  const std::vector<ElasticEntry> all =
      DecomposeElasticLines(elastic, LineMasses(context), context.model.grid_columns(),
                            context.plan.schedule.largest_force_interval_s2());
  for (const ElasticFamily& family : elastic.families) {
    const auto lines =
        std::span(elastic.lines).subspan(family.line_begin, family.line_end - family.line_begin);
    if (family.kind == ElasticKind::kCells) {
      SolveCells(context, lines, all);
      continue;
    }
    for (const ElasticLine& line : lines) {
      const auto entries = Entries(all).subspan(line.entry_begin, line.count);
      if (family.kind == ElasticKind::kRods) {
        SolveRods(context, line, entries);
      } else {
        SolveDiagonals(context, line, family.rest_length_m, entries);
      }
    }
  }
}

}  // namespace drape::reference
