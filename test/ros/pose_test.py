#!/usr/bin/env python3
"""Pose in, state, contacts and force out; topology, services; poses that no simulation can use."""
import math
import threading
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import WrenchStamped
from tissue_sim.msg import Contacts, TissueState, TissueTopology
from tissue_sim.srv import GetTopology, ResetOrgan
from visualization_msgs.msg import Marker, MarkerArray

from running_node import BALL_RADIUS, PROBE_RADIUS, RunningNode, pose_message, stamp_of, wait_until

MS = 10**6  # ns
START = 1000 * 10**9
TOUCH = BALL_RADIUS + PROBE_RADIUS


def press(count, start=START, spacing=5 * MS, depth=0.004):
    """From 2 mm above the ball straight down to the depth."""
    for i in range(count):
        z = TOUCH + 0.002 - (0.002 + depth) * i / (count - 1)
        yield pose_message(start + i * spacing, (0, 0, z))


def finite(values):
    return all(math.isfinite(v) for v in values)


class PoseTest(unittest.TestCase):
    def start(self, name, **parameters):
        node = RunningNode(name, **parameters)
        self.addCleanup(node.stop)
        return node

    def test_outputs_carry_the_stamp_of_the_pose(self):
        node = self.start('stamps', keep_all_poses='true', state_period=0.001)
        states = node.listen('ball/state', TissueState)
        contacts = node.listen('contacts', Contacts)
        wrenches = node.listen('probe/measured_cf', WrenchStamped)
        topology = rospy.wait_for_message(node.name + '/ball/topology', TissueTopology, 10)
        stamps = []
        for message in press(40):
            stamps.append(stamp_of(message))
            node.poses.publish(message)
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == stamps[-1]))
        self.assertTrue(wait_until(lambda: states and stamp_of(states[-1]) == stamps[-1]))
        self.assertTrue(wait_until(lambda: wrenches and stamp_of(wrenches[-1]) == stamps[-1]))

        self.assertEqual([stamp_of(m) for m in contacts], stamps)
        self.assertEqual([stamp_of(m) for m in wrenches], stamps)
        state_at = {m.step: m for m in states}
        for message in contacts:
            self.assertEqual(stamp_of(state_at[message.step]), stamp_of(message))

        last = states[-1]
        self.assertEqual(last.header.frame_id, 'world')
        self.assertEqual(last.topology_id, topology.topology_id)
        self.assertEqual(len(last.positions), len(topology.rest_positions))
        self.assertEqual(3 * len(last.depths), len(last.positions))
        self.assertTrue(finite(last.positions) and finite(last.depths))
        self.assertGreater(max(last.depths), 0.001)

        self.assertEqual(len(contacts[0].contacts), 0, 'the probe starts above the ball')
        self.assertGreater(len(contacts[-1].contacts), 0)
        for contact in contacts[-1].contacts:
            self.assertEqual((contact.organ, contact.instrument, contact.link), ('ball', 'probe', 'tip'))
            self.assertAlmostEqual(sum(contact.barycentric), 1.0, places=4)
            self.assertLess(contact.triangle, len(topology.triangles) // 3)
            self.assertTrue(finite([contact.depth, contact.force.x, contact.force.y, contact.force.z]))
        force = wrenches[-1].wrench.force
        self.assertEqual(wrenches[-1].header.frame_id, 'world')
        self.assertGreater(force.z, 0.0, 'the ball pushes the probe up')
        self.assertGreater(force.z, 5 * math.hypot(force.x, force.y))

    def test_topology_reaches_a_late_subscriber(self):
        node = self.start('late')
        time.sleep(1.0)
        latched = rospy.wait_for_message(node.name + '/ball/topology', TissueTopology, 10)
        self.assertEqual(len(latched.triangles) % 3, 0)
        self.assertEqual(max(latched.triangles), len(latched.rest_positions) // 3 - 1)
        asked = rospy.ServiceProxy(node.name + '/get_topology', GetTopology)('ball')
        self.assertTrue(asked.success)
        self.assertEqual(asked.topology.topology_id, latched.topology_id)
        self.assertEqual(asked.topology.rest_positions, latched.rest_positions)
        unknown = rospy.ServiceProxy(node.name + '/get_topology', GetTopology)('bell')
        self.assertFalse(unknown.success)
        self.assertIn('ball', unknown.message)

    def test_markers_show_the_organ_before_the_first_pose(self):
        node = self.start('shown')
        markers = rospy.wait_for_message(node.name + '/markers', MarkerArray, 10).markers
        organ = [m for m in markers if m.ns == 'organ/ball']
        self.assertEqual(len(organ), 1)
        self.assertEqual(organ[0].type, Marker.TRIANGLE_LIST)
        self.assertEqual(len(organ[0].points), len(organ[0].colors))

    def test_reset_under_load(self):
        node = self.start('resets', state_period=0.005)
        states = node.listen('ball/state', TissueState)
        reset = rospy.ServiceProxy(node.name + '/reset', ResetOrgan)
        done = threading.Event()

        def keep_pressing():
            i = 0
            while not done.is_set() and not rospy.is_shutdown():
                z = TOUCH - 0.003 + 0.001 * math.sin(0.05 * i)
                node.poses.publish(pose_message(START + i * 4 * MS, (0, 0, z)))
                i += 1
                time.sleep(0.004)

        pressing = threading.Thread(target=keep_pressing)
        pressing.start()
        try:
            self.assertTrue(wait_until(lambda: len(states) > 5))
            steps = []
            for i in range(20):
                answer = reset('ball' if i % 2 else '')
                self.assertTrue(answer.success, answer.message)
                steps.append(answer.step)
                time.sleep(0.02)
            self.assertEqual(steps, sorted(steps))
            self.assertGreater(steps[-1], steps[0])
            unknown = reset('bell')
            self.assertFalse(unknown.success)
            self.assertIn('bell', unknown.message)
            self.assertIn('ball', unknown.message)
        finally:
            done.set()
            pressing.join()
        self.assertTrue(node.counted('resets', 20))
        numbers = [m.step for m in states]
        self.assertEqual(numbers, sorted(set(numbers)), 'steps never go back')
        self.assertTrue(all(finite(m.positions) and finite(m.depths) for m in states))

    def test_reset_puts_the_organ_back(self):
        node = self.start('rest', keep_all_poses='true', state_period=0.001)
        states = node.listen('ball/state', TissueState)
        rest = rospy.wait_for_message(node.name + '/ball/topology', TissueTopology, 10).rest_positions
        poses = list(press(20))
        for message in poses:
            node.poses.publish(message)
        self.assertTrue(wait_until(lambda: states and stamp_of(states[-1]) == stamp_of(poses[-1])))
        off_rest = max(abs(a - b) for a, b in zip(states[-1].positions, rest))
        self.assertGreater(off_rest, 0.001)
        answer = rospy.ServiceProxy(node.name + '/reset', ResetOrgan)('ball')
        self.assertEqual(answer.step, states[-1].step)
        # Far away in one pose: what is left of the dent is what the way out pressed in.
        node.poses.publish(pose_message(stamp_of(poses[-1]) + 1 * MS, (0, 0, 0.2)))
        self.assertTrue(wait_until(lambda: states[-1].step > answer.step))

    def test_poses_that_cannot_be_used_are_dropped_and_counted(self):
        node = self.start('faults', keep_all_poses='true', state_period=0.001)
        states = node.listen('ball/state', TissueState)
        good = list(press(20))
        for message in good:
            node.poses.publish(message)
        last, above = stamp_of(good[-1]), (0, 0, TOUCH - 0.003)
        faulty = [
            pose_message(last + 1 * MS, (float('nan'), 0, TOUCH)),
            pose_message(last + 2 * MS, (0, float('inf'), TOUCH)),
            pose_message(last + 3 * MS, above, (0, 0, 0, float('nan'))),
            pose_message(last + 4 * MS, above, (0, 0, 0, 0)),
            pose_message(0, above),
            pose_message(last - 558, above),
        ]
        for message in faulty:
            node.poses.publish(message)
        # Off unit length by a factor of two: taken, normalised, said.
        node.poses.publish(pose_message(last + 5 * MS, above, (0, 0, 0, 2)))
        # Ten seconds back: a new run.
        for message in press(20, start=START - 10 * 10**9):
            node.poses.publish(message)
        self.assertTrue(node.counted('poses_used', 41), node.diagnostics)
        expected = {'dropped_non_finite': '3', 'dropped_zero_quaternion': '1', 'dropped_zero_stamp': '1',
                    'dropped_stale': '1', 'new_runs': '1', 'normalised_quaternions': '1',
                    'dropped_missing_transform': '0', 'recoveries': '0'}
        self.assertEqual({key: node.diagnostics[key] for key in expected}, expected)
        self.assertTrue(wait_until(lambda: stamp_of(states[-1]) == START - 10 * 10**9 + 19 * 5 * MS))
        self.assertTrue(all(finite(m.positions) and finite(m.depths) for m in states))
        numbers = [m.step for m in states]
        self.assertEqual(numbers, sorted(set(numbers)), 'steps never go back, not even in a new run')

    def test_realtime_goes_on_without_poses(self):
        node = self.start('live', advance='realtime', state_period=0.01)
        states = node.listen('ball/state', TissueState)
        now = rospy.Time.now().to_nsec()
        for message in press(20, start=now):
            node.poses.publish(message)
            time.sleep(0.005)
        last = now + 19 * 5 * MS
        self.assertTrue(wait_until(lambda: states and stamp_of(states[-1]) > last + 200 * MS),
                        'time goes on 0.2 s past the last pose')
        behind = rospy.Time.now().to_nsec() - stamp_of(states[-1])
        self.assertGreater(behind, 50 * MS, 'it stays behind the clock, for a pose that is late')


if __name__ == '__main__':
    rospy.init_node('pose_test')
    rostest.rosrun('tissue_sim', 'pose_test', PoseTest)
