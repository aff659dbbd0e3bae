#include "server/solver/self_contact/contact_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/scenes.h"

namespace drape::test {
namespace {

std::vector<Scene> Sheets() {
  return {Grid(2, 2, 0.1, 0.1), Grid(17, 9, 1, 0.5), MeshedGrid(12, 13, 1, 1), Grid(1, 5, 0.2, 1)};
}

TEST(ContactSurface, EveryPrimitiveIsInOnePatchAndEveryPatchInTheTree) {
  for (const Scene& scene : Sheets()) {
    const ContactSurface surface(*scene.model);
    std::multiset<uint32_t> triangles, edges, vertices, leaves;
    for (const ContactPatch& patch : surface.patches()) {
      for (const uint32_t t : surface.triangles_of(patch)) triangles.insert(t);
      for (const uint32_t e : surface.edges_of(patch)) edges.insert(e);
      for (const uint32_t i : surface.vertices_of(patch)) vertices.insert(i);
      // Boxes are made of the corners.
      const auto corners = surface.corners_of(patch);
      const auto is_corner = [&](uint32_t i) {
        return std::binary_search(corners.begin(), corners.end(), i);
      };
      for (const uint32_t e : surface.edges_of(patch)) {
        EXPECT_TRUE(is_corner(surface.edges()[e][0]) && is_corner(surface.edges()[e][1]));
      }
      for (const uint32_t i : surface.vertices_of(patch)) EXPECT_TRUE(is_corner(i));
    }
    for (const ContactNode& node : surface.nodes()) {
      if (node.first_child == 0) leaves.insert(node.patch);
    }
    const auto expect_all = [](const std::multiset<uint32_t>& found, size_t count) {
      EXPECT_EQ(found.size(), count);
      EXPECT_EQ(std::set<uint32_t>(found.begin(), found.end()).size(), count);
    };
    expect_all(triangles, scene.model->triangles().size());
    expect_all(edges, surface.edges().size());
    expect_all(leaves, surface.patches().size());
    std::set<uint32_t> with_triangle;
    for (const auto& triangle : surface.triangles()) {
      with_triangle.insert(triangle.begin(), triangle.end());
    }
    expect_all(vertices, with_triangle.size());
  }
}

TEST(ContactSurface, NeighboursAreThePatchesThatShareAVertex) {
  for (const Scene& scene : Sheets()) {
    const ContactSurface surface(*scene.model);
    const auto patches = surface.patches();
    for (uint32_t a = 0; a < patches.size(); ++a) {
      for (uint32_t b = 0; b < patches.size(); ++b) {
        const auto of_a = surface.corners_of(patches[a]), of_b = surface.corners_of(patches[b]);
        const bool shares = std::any_of(of_a.begin(), of_a.end(), [&](uint32_t i) {
          return std::find(of_b.begin(), of_b.end(), i) != of_b.end();
        });
        EXPECT_EQ(surface.AreNeighbours(a, b), shares);
      }
    }
  }
}

TEST(ContactSurface, IsSharedByTheClothsOfAModel) {
  const Scene scene = Grid(5, 5, 1, 1);
  ContactSurfaceCache cache;
  const auto first = cache.Get(scene.model);
  EXPECT_EQ(cache.Get(scene.model), first);
  EXPECT_NE(cache.Get(Grid(6, 5, 1, 1).model), first);
}

}  // namespace
}  // namespace drape::test
