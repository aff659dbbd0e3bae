#include <algorithm>
#include <cmath>

#include "server/solver/cpu_reference/reference_directions.h"
#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape::reference {

namespace {

using Eigen::Vector3d;

// One link of a strip under way, from particle `from` to `to`.
struct Link {
  uint32_t from = 0, to = 0;
  double rest_length_m = 0;
  ImpulseLine line{};
  Vector3d n_end = Vector3d::Zero();  // unit, at the predicted positions
  double error_m = 0;                 // C + (alpha/h) lambda
  double diagonal = 0;                // (w_from + w_to) slope (1 + give) + alpha/h^2 [1/kg]
  // How the impulse of the next link changes this error: -w_to n_end . n_next [1/kg], and the
  // other way round; 0 for the last.
  double from_next = 0;
  double to_next = 0;
  double min_pivot = 0;  // [1/kg]
  double impulse = 0;    // delta lambda [N s]
};

std::vector<Link> Linearise(const StepContext& context, uint32_t strip) {
  const StripSet& strips = context.model.strips();
  const std::span<const double> w = context.w;
  const double h = context.substep.link_interval_s;
  const double force_s = context.substep.force_s();
  const double span_give = context.model.IsSpan(strip) ? context.plan.solver.span_give : 0;
  std::vector<Link> links;
  for (uint32_t k = strips.strip_offsets[strip]; k < strips.strip_offsets[strip + 1]; ++k) {
    const DistanceConstraint& constraint = context.model.constraints()[strips.constraints[k]];
    Link link{.from = strips.particles[k + strip], .to = strips.particles[k + strip + 1]};
    const Vector3d start = context.base[link.to] - context.base[link.from];
    const Vector3d d = start + h * (context.u[link.to] - context.u[link.from]);
    const double length = d.norm();
    link.rest_length_m = constraint.rest_length_m;
    link.n_end = DirectionOf(d);
    link.line = BlendDirections(start, d, context.plan.solver.end_share);
    link.error_m = length - constraint.rest_length_m +
                   constraint.compliance_m_per_n / force_s * context.lambda[strips.constraints[k]];
    link.diagonal = (w[link.from] + w[link.to]) * link.line.slope * (1 + span_give) +
                    constraint.compliance_m_per_n / (h * force_s);
    if (context.IsHeld(link.from, link.to)) {  // nothing to solve: a link of its own
      link.error_m = 0;
      link.diagonal = 1;
    }
    const bool ends_at_pin = w[link.to] == 0;
    link.min_pivot = (ends_at_pin ? kMinStripPivotAtPin : kMinStripPivot) * link.diagonal;
    if (!links.empty()) {
      Link& before = links.back();
      before.from_next = -w[link.from] * before.n_end.dot(link.line.direction);
      before.to_next = -w[link.from] * before.line.direction.dot(link.n_end);
    }
    links.push_back(link);
  }
  return links;
}

// Thomas's elimination of the tridiagonal system: sum over the links of (effect on this
// one's error) = -error, for the impulses.
void SolveTridiagonal(std::vector<Link>& links, double h) {
  std::vector<double> ratio(links.size());  // from_next / pivot
  for (size_t k = 0; k < links.size(); ++k) {
    double pivot = links[k].diagonal, right_side = -links[k].error_m / h;
    if (k > 0) {
      pivot -= links[k - 1].to_next * ratio[k - 1];
      right_side -= links[k - 1].to_next * links[k - 1].impulse;
    }
    pivot = std::max(pivot, links[k].min_pivot);
    ratio[k] = links[k].from_next / pivot;
    links[k].impulse = right_side / pivot;
  }
  for (size_t k = links.size() - 1; k-- > 0;) {
    links[k].impulse -= ratio[k] * links[k + 1].impulse;
  }
}

// The share of the impulses that moves no particle by more than kMaxStripMove lengths of the link
// before it (the first one: of its only one).
double StepLength(const std::vector<Link>& links, std::span<const double> w, double h) {
  double largest_move = 0;  // [link lengths]
  for (size_t k = 0; k <= links.size(); ++k) {
    const Link& nearest = links[k == 0 ? 0 : k - 1];
    const uint32_t particle = k == 0 ? nearest.from : nearest.to;
    Vector3d change = Vector3d::Zero();
    if (k > 0) change += links[k - 1].impulse * links[k - 1].line.direction;
    if (k < links.size()) change -= links[k].impulse * links[k].line.direction;
    largest_move = std::max(largest_move, h * w[particle] * change.norm() / nearest.rest_length_m);
  }
  return largest_move > kMaxStripMove ? kMaxStripMove / largest_move : 1;
}

bool SolveStrip(StepContext& context, uint32_t strip) {
  const StripSet& strips = context.model.strips();
  const double tolerance = context.plan.tolerance;
  std::vector<Link> links = Linearise(context, strip);
  const bool is_within_tolerance =
      tolerance > 0 && std::ranges::all_of(links, [&](const Link& link) {
        return std::abs(link.error_m) <= tolerance * link.rest_length_m;
      });
  if (is_within_tolerance) return false;

  SolveTridiagonal(links, context.substep.link_interval_s);
  const double share = StepLength(links, context.w, context.substep.link_interval_s);
  for (size_t k = 0; k < links.size(); ++k) {
    const Link& link = links[k];
    const double impulse = share * link.impulse;
    context.lambda[strips.constraints[strips.strip_offsets[strip] + k]] += impulse;
    context.u[link.from] -= context.w[link.from] * impulse * link.line.direction;
    context.u[link.to] += context.w[link.to] * impulse * link.line.direction;
    context.Pull(link.from, -impulse * link.line.direction);
    context.Pull(link.to, impulse * link.line.direction);
  }
  return true;
}

}  // namespace

// All strips, phase by phase: the impulses that remove the errors of each strip's constraints
// together.
bool SolveStrips(StepContext& context, uint32_t begin, uint32_t end) {
  if (!context.plan.Has(StepStage::kSolveStrips)) return false;
  bool has_changed = false;
  for (uint32_t strip = begin; strip < end; ++strip) {
    if (SolveStrip(context, strip)) has_changed = true;
  }
  return has_changed;
}

}  // namespace drape::reference
