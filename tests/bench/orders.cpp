#include "tests/bench/orders.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <numeric>

#include "server/scene/colouring.h"

namespace drape::bench {
namespace {

std::vector<DistanceConstraint> ListOf(const SceneModel& model) {
  return {model.constraints().begin(), model.constraints().end()};
}

// Not std::shuffle, whose result depends on the library.
template <class T>
void Shuffle(std::vector<T>& values, std::mt19937& random) {
  for (size_t left = values.size(); left > 1; --left) {
    std::swap(values[left - 1], values[random() % left]);
  }
}

// Constraints between each particle and the nearest pin.
std::vector<uint32_t> DistanceToPins(const SceneModel& model) {
  constexpr uint32_t kUnreached = std::numeric_limits<uint32_t>::max();
  std::vector<std::vector<uint32_t>> neighbours(model.particle_count());
  for (const DistanceConstraint& c : model.constraints()) {
    neighbours[c.i].push_back(c.j);
    neighbours[c.j].push_back(c.i);
  }
  std::vector<uint32_t> distance(model.particle_count(), kUnreached);
  std::deque<uint32_t> queue(model.pins().begin(), model.pins().end());
  for (const uint32_t pin : queue) distance[pin] = 0;
  for (; !queue.empty(); queue.pop_front()) {
    for (const uint32_t next : neighbours[queue.front()]) {
      if (distance[next] != kUnreached) continue;
      distance[next] = distance[queue.front()] + 1;
      queue.push_back(next);
    }
  }
  return distance;
}

}  // namespace

ConstraintOrder ModelOrder(const SceneModel& model) {
  return {ListOf(model), model.colour_count()};
}

ConstraintOrder ShuffleColours(const SceneModel& model, std::mt19937& random) {
  std::vector<uint32_t> colours(model.colour_count());
  std::iota(colours.begin(), colours.end(), 0);
  Shuffle(colours, random);
  ConstraintOrder order{{}, model.colour_count()};
  const auto offsets = model.colour_offsets();
  for (const uint32_t colour : colours) {
    const auto group =
        model.constraints().subspan(offsets[colour], offsets[colour + 1] - offsets[colour]);
    order.constraints.insert(order.constraints.end(), group.begin(), group.end());
  }
  return order;
}

ConstraintOrder ShuffleInput(const SceneModel& model, std::mt19937& random) {
  std::vector<DistanceConstraint> list = ListOf(model);
  Shuffle(list, random);
  const std::vector<uint32_t> colours = ColourConstraints(list, model.particle_count());
  std::vector<std::vector<DistanceConstraint>> groups;
  for (size_t k = 0; k < list.size(); ++k) {
    if (colours[k] >= groups.size()) groups.resize(colours[k] + 1);
    groups[colours[k]].push_back(list[k]);
  }
  ConstraintOrder order{{}, static_cast<uint32_t>(groups.size())};
  for (const auto& group : groups) {
    order.constraints.insert(order.constraints.end(), group.begin(), group.end());
  }
  return order;
}

ConstraintOrder ShuffleAll(const SceneModel& model, std::mt19937& random) {
  ConstraintOrder order{ListOf(model), 0};
  Shuffle(order.constraints, random);
  return order;
}

ConstraintOrder FromPins(const SceneModel& model) {
  const std::vector<uint32_t> distance = DistanceToPins(model);
  ConstraintOrder order{ListOf(model), 0};
  std::stable_sort(order.constraints.begin(), order.constraints.end(),
                   [&](const DistanceConstraint& a, const DistanceConstraint& b) {
                     return distance[a.i] + distance[a.j] < distance[b.i] + distance[b.j];
                   });
  return order;
}

ConstraintOrder TowardsPins(const SceneModel& model) {
  ConstraintOrder order = FromPins(model);
  std::reverse(order.constraints.begin(), order.constraints.end());
  return order;
}

}  // namespace drape::bench
