#!/usr/bin/env python3
"""/clock that goes back, leaps years, stands still or never comes: the steps go on with the poses' own stamps."""
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Clock
from tissue_sim.msg import Contacts, TissueState

from running_node import BALL_RADIUS, LONG, PROBE_RADIUS, RunningNode, pose_message, stamp_of, wait_until

MS = 10**6  # ns
SECOND = 10**9
YEAR = 31557600 * SECOND
TOUCH = BALL_RADIUS + PROBE_RADIUS
LAST_CLOCK = (2**32 - 1) * SECOND  # what a message can hold: the year 2106


class ClockTest(unittest.TestCase):
    def setUp(self):
        rospy.set_param('/use_sim_time', True)
        self.addCleanup(rospy.delete_param, '/use_sim_time')
        self.clock = rospy.Publisher('/clock', Clock, queue_size=100)
        self.addCleanup(self.clock.unregister)

    def start(self, name, **parameters):
        node = RunningNode(name, **parameters)
        self.addCleanup(node.stop)
        self.assertTrue(wait_until(lambda: self.clock.get_num_connections() > 0))
        return node

    def show(self, nanoseconds):
        self.clock.publish(Clock(rospy.Time(nanoseconds // SECOND, nanoseconds % SECOND)))

    def run_clock(self, start, seconds):
        """From `start` (ns) at its own pace, 100 times a second; where it ended."""
        for i in range(int(100 * seconds)):
            self.show(start + i * 10 * MS)
            time.sleep(0.01)
        return start + int(100 * seconds) * 10 * MS

    def steps(self, node):
        """How many there are once diagnostics have said it twice: the same number where none is made any more."""
        seen = node.diagnostics
        self.assertTrue(wait_until(lambda: node.diagnostics is not seen), 'diagnostics need no clock')
        return int(node.diagnostics['steps'])

    def test_steps_on_poses_do_not_look_at_it(self):
        node = self.start('clock_on_pose', keep_all_poses='true')
        contacts = node.listen('contacts', Contacts)
        stamp = 1000 * SECOND
        # Never shown; going; back; years on; its end; standing.
        for shown in (None, 500 * SECOND, 400 * SECOND, 10 * YEAR, LAST_CLOCK, LAST_CLOCK, 1 * SECOND):
            if shown is not None:
                self.show(shown)
            for _ in range(20):
                stamp += 5 * MS
                node.poses.publish(pose_message(stamp, (0, 0, TOUCH - 0.002)))
            self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == stamp), (shown, node.diagnostics))
        self.assertTrue(node.counted('poses_used', 140), node.diagnostics)
        self.assertEqual(node.diagnostics['new_runs'], '0')
        self.assertEqual(len(contacts), 140)

    def test_realtime_goes_with_it(self):
        node = self.start('clock_realtime', advance='realtime', state_period=0.01)
        states = node.listen('ball/state', TissueState)
        wrenches = node.listen('probe/measured_cf', WrenchStamped)
        seconds = 20 if LONG else 1
        now = self.run_clock(100 * SECOND, 0.2)
        pose = now
        node.poses.publish(pose_message(pose, (0, 0, TOUCH - 0.002)))
        self.assertTrue(wait_until(lambda: wrenches), 'the pose is taken')
        now = self.run_clock(now, seconds)
        self.assertTrue(wait_until(lambda: states and stamp_of(states[-1]) > now - 200 * MS), 'time goes on')

        # Standing: no more steps.
        time.sleep(0.2)
        steps = self.steps(node)
        time.sleep(1.2)
        self.assertEqual(self.steps(node), steps, 'a clock that stands holds time')

        # Back by a minute, on by ten years, to the end of time: none of it is time that went by, and time goes on from
        # there.
        shown = stamp_of(states[-1])
        for leap in (now - 60 * SECOND, now + 10 * YEAR, now + 40 * YEAR, LAST_CLOCK - 3600 * SECOND, 50 * SECOND):
            before = int(node.diagnostics['steps'])
            now = self.run_clock(leap, seconds)
            self.assertTrue(wait_until(lambda: stamp_of(states[-1]) > shown + 800 * MS), 'it goes on after a leap')
            self.assertLess(stamp_of(states[-1]), shown + (seconds + 1) * SECOND, 'not a step for the leap itself')
            shown = stamp_of(states[-1])
            self.assertLess(self.steps(node) - before, 1000 * (seconds + 2))
        self.assertIsNone(node.process.poll())

        # A pose of the new time begins a new run where it is far from the old one.
        node.poses.publish(pose_message(now + YEAR, (0, 0, TOUCH - 0.002)))
        self.assertTrue(wait_until(lambda: stamp_of(states[-1]) >= now + YEAR), node.diagnostics)
        self.assertTrue(node.counted('new_runs', 1), node.diagnostics)
        self.assertEqual(node.diagnostics['recoveries'], '0')


if __name__ == '__main__':
    rospy.init_node('clock_test', disable_rostime=True)
    rostest.rosrun('tissue_sim', 'clock_test', ClockTest)
