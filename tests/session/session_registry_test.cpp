#include "server/session/session_registry.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "server/session/page_token.h"
#include "tests/session/session_fixture.h"

namespace drape {
namespace {

constexpr int64_t kSecond_us = 1000000;

class SessionRegistryTest : public SessionFixture {
 protected:
  std::string CreateAndLetGo(double ttl_s) { return registry_->Create(ttl_s, "").value()->name(); }
  Status Delete(const std::string& name) {
    Awaited<Status> done;
    registry_->Delete(name, [done](const Status& s) mutable { done.Set(s); });
    return done.Get();
  }
};

TEST_F(SessionRegistryTest, NamesCarryTheServerAndCannotBeGuessed) {
  Start();
  std::set<std::string> names;
  for (int k = 0; k < 100; ++k) names.insert(CreateAndLetGo(60));
  EXPECT_EQ(names.size(), 100u);
  for (const std::string& name : names) {
    EXPECT_TRUE(name.starts_with("sessions/server7-"));
    EXPECT_EQ(name.size(), std::string("sessions/server7-").size() + 32);
  }
}

TEST_F(SessionRegistryTest, ShortNamesDoNotGiveAccess) {
  EXPECT_EQ(ShortSessionName("sessions/s-0123456789abcdef0123456789abcdef"), "sessions/s-0123...");
  EXPECT_EQ(ShortSessionName("nonsense"), "nonsense");
}

TEST_F(SessionRegistryTest, LeasesOutOfRangeAreRefused) {
  Start();
  for (const double ttl_s : {0.0, 0.999, 86400.5, -1.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    const auto created = registry_->Create(ttl_s, "");
    ASSERT_FALSE(created.ok()) << ttl_s;
    EXPECT_EQ(created.status().violations()[0].field, "ttl_s");
  }
  EXPECT_EQ(registry_->Create(1, std::string(257, 'x')).status().violations()[0].field,
            "display_name");
  EXPECT_EQ(registry_->Get(CreateAndLetGo(1))->ttl_s, 1);
  EXPECT_EQ(registry_->Get(CreateAndLetGo(86400))->ttl_s, 86400);
  EXPECT_EQ(lease_->ttl_s(), kDefaultTtl_s);
}

TEST_F(SessionRegistryTest, AnUnusedSessionExpiresWithItsCloths) {
  Start();
  const std::string name = CreateAndLetGo(10);
  {
    const auto lease = registry_->Find(name).value();
    ASSERT_TRUE(Create(*lease, Chains(3, 2)).ok());
  }
  clock_.AdvanceUs(10 * kSecond_us - 1);
  EXPECT_EQ(registry_->ReapExpired(), 0u);
  EXPECT_TRUE(registry_->Get(name).ok());
  clock_.AdvanceUs(1);
  // Expired even before the reaper has come.
  EXPECT_EQ(registry_->Find(name).status().reason(), "SESSION_EXPIRED");
  EXPECT_EQ(registry_->Get(name).status().reason(), "SESSION_EXPIRED");
  EXPECT_EQ(registry_->ReapExpired(), 1u);
  EXPECT_EQ(registry_->Find(name).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(registry_->Find(name).status().reason(), "SESSION_EXPIRED");
  Inspect([](const FakeBackend&) {});  // after the reaper's command
  EXPECT_EQ(device_->live_cloths(), 0u);
  EXPECT_EQ(registry_->Totals().session_count, 1u);  // the fixture's own
}

TEST_F(SessionRegistryTest, EveryRequestRenewsTheLeaseAndGetDoesNot) {
  Start();
  const std::string name = CreateAndLetGo(10);
  clock_.AdvanceUs(9 * kSecond_us);
  EXPECT_EQ(registry_->Get(name)->remaining_s, 1);
  { const auto lease = registry_->Find(name); }
  EXPECT_EQ(registry_->Get(name)->remaining_s, 10);
  clock_.AdvanceUs(9 * kSecond_us);
  EXPECT_EQ(registry_->Renew(name)->remaining_s, 10);
  clock_.AdvanceUs(9 * kSecond_us);
  EXPECT_EQ(registry_->ReapExpired(), 0u);
  clock_.AdvanceUs(kSecond_us);
  EXPECT_EQ(registry_->ReapExpired(), 1u);
}

TEST_F(SessionRegistryTest, ASessionWithARequestUnderWayDoesNotExpire) {
  Start();
  const std::string name = CreateAndLetGo(10);
  auto lease = registry_->Find(name).value();
  clock_.AdvanceUs(1000 * kSecond_us);
  EXPECT_EQ(registry_->ReapExpired(), 0u);
  EXPECT_EQ(registry_->Get(name)->remaining_s, 10);
  SessionLease moved = std::move(lease);  // still one request
  EXPECT_FALSE(lease);  // NOLINT(bugprone-use-after-move): tests the moved-from lease
  EXPECT_EQ(registry_->ReapExpired(), 0u);
  moved = {};
  EXPECT_EQ(registry_->ReapExpired(), 0u);  // renewed at the end of the request
  clock_.AdvanceUs(10 * kSecond_us);
  EXPECT_EQ(registry_->ReapExpired(), 1u);
}

TEST_F(SessionRegistryTest, UnknownAndDeletedSessionsAreNotFound) {
  Start();
  EXPECT_EQ(registry_->Find("sessions/server7-00").status().reason(), "SESSION_NOT_FOUND");
  const std::string name = CreateAndLetGo(10);
  EXPECT_TRUE(Delete(name).ok());
  EXPECT_EQ(registry_->Find(name).status().reason(), "SESSION_NOT_FOUND");
  EXPECT_EQ(Delete(name).reason(), "SESSION_NOT_FOUND");
}

TEST_F(SessionRegistryTest, ExpiredNamesAreRememberedOnlySoLong) {
  SessionLimits limits;
  limits.max_ended_names = 2;
  Start(limits);
  std::vector<std::string> names;
  for (int k = 0; k < 3; ++k) {
    names.push_back(CreateAndLetGo(1));
    clock_.AdvanceUs(kSecond_us);
    EXPECT_EQ(registry_->ReapExpired(), 1u);
  }
  EXPECT_EQ(registry_->Find(names[0]).status().reason(), "SESSION_NOT_FOUND");
  EXPECT_EQ(registry_->Find(names[1]).status().reason(), "SESSION_EXPIRED");
  EXPECT_EQ(registry_->Find(names[2]).status().reason(), "SESSION_EXPIRED");
}

TEST_F(SessionRegistryTest, LostNamesSaySoToTheirTenant) {
  Start();
  registry_->RememberLost("sessions/former-1", "one");
  EXPECT_EQ(registry_->Find("sessions/former-1", "one").status().reason(), "SESSION_LOST");
  EXPECT_EQ(registry_->Find("sessions/former-1", "two").status().reason(), "SESSION_NOT_FOUND");
  EXPECT_EQ(registry_->LostNames().size(), 1u);
}

TEST_F(SessionRegistryTest, SessionsAreLimited) {
  SessionLimits limits;
  limits.max_sessions = 2;
  Start(limits);
  const std::string name = CreateAndLetGo(10);
  const auto third = registry_->Create(10, "");
  EXPECT_EQ(third.status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(third.status().reason(), "TOO_MANY_SESSIONS");
  EXPECT_TRUE(Delete(name).ok());
  EXPECT_TRUE(registry_->Create(10, "").ok());
}

TEST_F(SessionRegistryTest, ListsArePagedInOrderOfCreation) {
  Start();
  std::vector<std::string> names{lease_->name()};
  for (int k = 0; k < 4; ++k) names.push_back(CreateAndLetGo(60));
  std::vector<std::string> seen;
  std::string token;
  do {
    const SessionPage page = registry_->List(2, token).value();
    for (const SessionView& view : page.sessions) seen.push_back(view.name);
    token = page.next_page_token;
  } while (!token.empty());
  EXPECT_EQ(seen, names);
  EXPECT_FALSE(registry_->List(2, "x").ok());
}

TEST_F(SessionRegistryTest, PagesDoNotTellHowManySessionsOthersMake) {
  Start();
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(registry_->Create(60, "", "bob").ok());
    EXPECT_TRUE(registry_->Create(60, "", "alice").ok());
  }
  const SessionPage page = registry_->List(2, "", "alice").value();
  EXPECT_EQ(page.sessions.size(), 2u);
  EXPECT_EQ(page.next_page_token, MakePageToken(2)) << "her second one";
  EXPECT_EQ(registry_->List(2, page.next_page_token, "alice").value().sessions.size(), 1u);
}

TEST_F(SessionRegistryTest, TotalsAddUp) {
  Start();
  const auto other = registry_->Create(60, "").value();
  ASSERT_TRUE(Create(Chains(2, 5)).ok());
  ASSERT_TRUE(Create(*other, Chains(1, 3)).ok());
  const ServerTotals totals = registry_->Totals();
  EXPECT_EQ(totals.session_count, 2u);
  EXPECT_EQ(totals.cloth_count, 3u);
  EXPECT_EQ(totals.particle_count, 13u);
}

TEST_F(SessionRegistryTest, DeletingASessionDuringAStepEndsItsRequestsAlone) {
  Start();
  auto other = registry_->Create(60, "").value();
  const auto mine = CreateOne();
  const auto theirs = other->FindCloths(Create(*other, Chains(2, 2)).value().ids).value();
  scheduler_->HoldForTest();
  const auto ends = BeginStep(theirs, 1000000);
  const auto goes_on = BeginStep({mine}, 5);
  scheduler_->ReleaseForTest();
  EXPECT_TRUE(Delete(other->name()).ok());
  EXPECT_EQ(ends.Get().status.code(), StatusCode::kNotFound);
  EXPECT_TRUE(goes_on.Get().status.ok());
  EXPECT_EQ(device_->live_cloths(), 1u);
}

TEST_F(SessionRegistryTest, ACreationThatTheDeletionOvertakesLeavesNothingBehind) {
  Start();
  auto other = registry_->Create(60, "").value();
  scheduler_->HoldForTest();
  Awaited<Result<CreatedCloths>> created;
  other->CreateCloths(Chains(4, 2),
                      [created](Result<CreatedCloths> r) mutable { created.Set(std::move(r)); });
  Awaited<Status> deleted;
  registry_->Delete(other->name(), [deleted](const Status& s) mutable { deleted.Set(s); });
  scheduler_->ReleaseForTest();
  EXPECT_EQ(created.Get().status().reason(), "SESSION_NOT_FOUND");
  EXPECT_TRUE(deleted.Get().ok());
  EXPECT_EQ(device_->live_cloths(), 0u);
  EXPECT_EQ(other->cloth_count(), 0u);
  EXPECT_EQ(Create(*other, Chains(1, 2)).status().reason(), "SESSION_NOT_FOUND");
}

}  // namespace
}  // namespace drape
