#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

TEST(GetCloth, ShowsWhatWasAskedForResolved) {
  ServerProcess server{{}};
  ASSERT_TRUE(server.WaitUntilUp());
  const std::unique_ptr<Stub> stub = server.NewStub();
  const std::string session = NewSession(*stub);
  v1::CreateClothsRequest creation = GoodCreation();
  creation.set_session(session);
  const Ids ids = Create(*stub, creation);
  const v1::Cloth cloth = Get(*stub, session, ids.at(1));
  EXPECT_EQ(cloth.settings().preset(), v1::StepSettings::ACCURATE);
  EXPECT_EQ(cloth.settings().substeps(), 7u);
  EXPECT_EQ(cloth.settings().max_iterations(), 3u);
  EXPECT_EQ(cloth.settings().time_step_s(), 1.0 / 60);
  EXPECT_THAT(cloth.environment().gravity_m_per_s2(), testing::ElementsAre(0, -1, 0));
  EXPECT_THAT(cloth.environment().wind_m_per_s(), testing::ElementsAre(0, 0, 7));
  EXPECT_THAT(cloth.environment().colliders(1).plane().normal(), testing::ElementsAre(0, 1, 0));
  EXPECT_THAT(cloth.environment_origin_m(), testing::ElementsAre(10, 0, 0));
  EXPECT_EQ(cloth.pins_size(), 2);
  EXPECT_FALSE(cloth.faulted());
}

}  // namespace
}  // namespace drape::test
