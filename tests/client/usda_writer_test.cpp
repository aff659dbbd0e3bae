// USD text read back by the tests' own strict reader.
#include <gmock/gmock.h>

#include <limits>

#include "client/cli/state_writers.h"
#include "tests/client/state_file_test_support.h"
#include "tests/client/usda_reader.h"

namespace drape::cli {
namespace {

using client_test::kThird;
using client_test::MakeStates;
using client_test::ParseUsda;
using client_test::ReadText;
using client_test::TwoCloths;
using client_test::UsdaLayer;
using client_test::UsdaPrim;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::Pair;

using UsdaWriterTest = client_test::StateFileTest;

TEST_F(UsdaWriterTest, TheStageSaysUnitsAxesAndTimes) {
  const UsdaLayer layer = ParseUsda(ReadText(Written("s.usda")));
  EXPECT_THAT(layer.metadata, ElementsAre(Pair("defaultPrim", "scene"), Pair("doc", "Drape"),
                                          Pair("endTimeCode", "2"), Pair("framesPerSecond", "10"),
                                          Pair("metersPerUnit", "1"), Pair("startTimeCode", "1"),
                                          Pair("timeCodesPerSecond", "10"), Pair("upAxis", "Y")));
  ASSERT_EQ(layer.prims.size(), 1u);
  EXPECT_EQ(layer.prims[0].type, "Xform");
  EXPECT_EQ(layer.prims[0].name, "scene");
  EXPECT_THAT(layer.prims[0].metadata, ElementsAre(Pair("kind", "component")));
  ASSERT_EQ(layer.prims[0].children.size(), 2u);
}

TEST_F(UsdaWriterTest, ClothsWithTrianglesAreMeshes) {
  const UsdaPrim mesh = ParseUsda(ReadText(Written("s.usda"))).prims.at(0).children.at(0);
  EXPECT_EQ(mesh.type, "Mesh");
  EXPECT_EQ(mesh.name, "cloth_0");
  EXPECT_THAT(mesh.attributes,
              ElementsAre(Key("doubleSided"), Key("extent"), Key("faceVertexCounts"),
                          Key("faceVertexIndices"), Key("points"), Key("subdivisionScheme"),
                          Key("velocities")));
  EXPECT_EQ(mesh.attributes.at("doubleSided").declaration, "uniform bool");
  EXPECT_EQ(mesh.attributes.at("doubleSided").value, "1");
  EXPECT_EQ(mesh.attributes.at("subdivisionScheme").value, "none");
  EXPECT_THAT(mesh.attributes.at("faceVertexCounts").elements, ElementsAre(3));
  EXPECT_THAT(mesh.attributes.at("faceVertexIndices").elements, ElementsAre(0, 1, 2));
  const auto& points = mesh.attributes.at("points");
  EXPECT_EQ(points.declaration, "point3f[]");
  EXPECT_THAT(points.samples, ElementsAre(Pair(1, ElementsAre(1, 2, 3, 4, kThird, 6, 7, 8, 9)),
                                          Pair(2, ElementsAre(2, 3, 4, 5, kThird, 7, 8, 9, 10))));
  const auto& extent = mesh.attributes.at("extent");
  EXPECT_EQ(extent.declaration, "float3[]");
  EXPECT_THAT(extent.samples, ElementsAre(Pair(1, ElementsAre(1, kThird, 3, 7, 8, 9)),
                                          Pair(2, ElementsAre(2, kThird, 4, 8, 9, 10))));
  const auto& velocities = mesh.attributes.at("velocities");
  EXPECT_EQ(velocities.declaration, "vector3f[]");
  EXPECT_THAT(velocities.samples, ElementsAre(Key(1), Key(2)));
  EXPECT_THAT(velocities.samples.at(2),
              ::testing::AllOf(::testing::SizeIs(9), ::testing::Each(0.5f)));
}

TEST_F(UsdaWriterTest, LinesAreCurves) {
  const UsdaPrim curves = ParseUsda(ReadText(Written("s.usda"))).prims.at(0).children.at(1);
  EXPECT_EQ(curves.type, "BasisCurves");
  EXPECT_EQ(curves.name, "cloth_1");
  EXPECT_EQ(curves.attributes.at("type").value, "linear");
  EXPECT_THAT(curves.attributes.at("curveVertexCounts").elements, ElementsAre(2));
  EXPECT_THAT(curves.attributes.at("points").samples.at(2), ElementsAre(11, 12, 13, 14, 15, 16));
  EXPECT_EQ(curves.attributes.at("velocities").samples.at(1).at(5), -1e-20f);
  EXPECT_THAT(curves.attributes.at("widths").metadata,
              ElementsAre(Pair("interpolation", "constant")));
  const float radius = curves.attributes.at("widths").elements.at(0) / 2;
  EXPECT_THAT(
      curves.attributes.at("extent").samples.at(2),
      ElementsAre(11 - radius, 12 - radius, 13 - radius, 14 + radius, 15 + radius, 16 + radius));
}

// Lines 3-1, 1-0 and 3-0; particles 2 and 4 are in none.
TEST_F(UsdaWriterTest, EveryParticleIsAPointOfSomePrim) {
  Topology topology;
  topology.lines = {{3, 1}, {1, 0}, {3, 0}};
  std::vector<float> positions(15);
  for (size_t k = 0; k < 5; ++k) positions[3 * k] = static_cast<float>(k);
  const auto writer = MakeUsdaWriter(folder_ / "s.usda", {{topology}, 0.1});
  writer->Add(MakeStates({5}, 1, positions, positions));
  writer->Finish();
  const auto prims = ParseUsda(ReadText(folder_ / "s.usda")).prims.at(0).children;
  ASSERT_EQ(prims.size(), 2u);
  EXPECT_THAT(prims[0].attributes.at("curveVertexCounts").elements, ElementsAre(3, 2));
  EXPECT_THAT(prims[0].attributes.at("primvars:particle").elements, ElementsAre(3, 1, 0, 3, 0));
  EXPECT_THAT(prims[0].attributes.at("points").samples.at(1),
              ElementsAre(3, 0, 0, 1, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0));
  EXPECT_EQ(prims[1].type, "Points");
  EXPECT_EQ(prims[1].name, "cloth_0_loose");
  EXPECT_THAT(prims[1].attributes.at("primvars:particle").elements, ElementsAre(2, 4));
  EXPECT_THAT(prims[1].attributes.at("points").samples.at(1), ElementsAre(2, 0, 0, 4, 0, 0));
}

// As `drape read` writes them: no topology, no time step.
TEST_F(UsdaWriterTest, WithoutATimeStepATimeCodeIsASecond) {
  const auto writer = MakeUsdaWriter(folder_ / "s.usda", {});
  writer->Add(TwoCloths(7));
  writer->Finish();
  const UsdaLayer layer = ParseUsda(ReadText(folder_ / "s.usda"));
  EXPECT_EQ(layer.metadata.at("timeCodesPerSecond"), "1");
  EXPECT_EQ(layer.metadata.at("startTimeCode"), "0.7");
  const UsdaPrim& points = layer.prims.at(0).children.at(0);
  EXPECT_EQ(points.type, "Points");
  EXPECT_EQ(points.name, "cloth_0");
  EXPECT_THAT(points.attributes.at("points").samples, ElementsAre(Key(0.7)));
}

TEST_F(UsdaWriterTest, TimeCodesAreThoseOfTheSamples) {
  const auto writer = MakeUsdaWriter(folder_ / "s.usda", {{}, 1.0 / 60});
  writer->Add(TwoCloths(1), SampleTime{60, 1});
  writer->Add(TwoCloths(1), SampleTime{1'000'000'007, 1.6e7});
  writer->Finish();
  const UsdaLayer layer = ParseUsda(ReadText(folder_ / "s.usda"));
  EXPECT_EQ(layer.metadata.at("timeCodesPerSecond"), "60");
  EXPECT_EQ(layer.metadata.at("endTimeCode"), "1000000007");
  EXPECT_THAT(layer.prims.at(0).children.at(0).attributes.at("points").samples,
              ElementsAre(Key(60), Key(1'000'000'007)));
}

TEST_F(UsdaWriterTest, DoublesAreRounded) {
  const auto writer = MakeUsdaWriter(folder_ / "d.usda", {});
  writer->Add(MakeStates<double>({1}, 3, {1.0 / 3, -1e300, 16777217}, {0, 0, 0}));
  writer->Finish();
  const UsdaPrim prim = ParseUsda(ReadText(folder_ / "d.usda")).prims.at(0).children.at(0);
  EXPECT_THAT(prim.attributes.at("points").samples.begin()->second,
              ElementsAre(kThird, std::numeric_limits<float>::lowest(), 16777216));
}

TEST_F(UsdaWriterTest, WithoutSamplesItIsStillAStage) {
  MakeUsdaWriter(folder_ / "none.usda", {})->Finish();
  EXPECT_THAT(ParseUsda(ReadText(folder_ / "none.usda")).prims.at(0).children, IsEmpty());
}

TEST(UsdaReaderTest, RefusesWhatIsNotUsd) {
  for (const char* text : {"", "#usda 2.0\n", "#usda 1.0\ndef X \"a\" {",
                           "#usda 1.0\n(a = 1 a = 2)", "#usda 1.0\ndef X \"a\" { int[] b = [1,] }",
                           "#usda 1.0\ndef X \"a\" { int[] b = [(1, 2)] }"}) {
    EXPECT_THROW(ParseUsda(text), std::runtime_error) << text;
  }
}

}  // namespace
}  // namespace drape::cli
