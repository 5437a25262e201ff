#!/usr/bin/env python3
"""The node fed by rosbag play, at any rate, ends with the hash of the offline replay."""
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

import rosbag
import rospy
import rostest
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from running_node import BALL_RADIUS, POSE_TOPIC, PROBE_RADIUS, SPHERE_SCENE, RunningNode, pose_message, program

START = 1600000000 * 10**9  # ns
TOUCH = BALL_RADIUS + PROBE_RADIUS


def record(path, frame):
    """1.5 s at about 100 Hz: press, slide, withdraw, with what real recordings have: uneven and backward stamps."""
    with rosbag.Bag(path, 'w') as bag:
        if frame != 'world':
            still = TransformStamped()
            still.header.frame_id, still.child_frame_id = 'world', frame
            still.header.stamp = rospy.Time(START // 10**9)
            still.transform.translation.x = 0.1
            still.transform.rotation.w = 1.0
            bag.write('/tf_static', TFMessage([still]), rospy.Time(START // 10**9))
        shift = 0.0 if frame == 'world' else -0.1
        for i in range(150):
            stamp = START + i * 10**7 + (i * 7919 % 1000) * 1000
            t = i / 149.0
            z = TOUCH + 0.002 - 0.006 * math.sin(math.pi * t)
            message = pose_message(stamp, (shift + 0.004 * math.sin(2 * math.pi * t), 0.0, z), frame=frame)
            if i == 70:
                message.header.stamp = previous - rospy.Duration(0, 558)
            previous = message.header.stamp
            bag.write('/' + POSE_TOPIC, message, rospy.Time(stamp // 10**9, stamp % 10**9))


class ReplayTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def offline(self, bag, name):
        out, summary = os.path.join(self.folder, name + '.bag'), os.path.join(self.folder, name + '.json')
        subprocess.check_output([program('tissue_sim_replay'), SPHERE_SCENE, bag, out, '--json', summary])
        with open(summary) as file:
            return json.load(file), out

    def played(self, name, bag, rate):
        node = RunningNode(name, keep_all_poses='true', tf_timeout=5.0)
        try:
            subprocess.check_call(['rosbag', 'play', '--quiet', '--delay=2', '--rate=%g' % rate, bag])
            expected = str(149)  # one of 150 is stale
            self.assertTrue(node.counted('poses_used', expected), node.diagnostics)
            return node.diagnostics['state_hash'], node.diagnostics['steps']
        finally:
            node.stop()

    def compare(self, name, frame):
        bag = os.path.join(self.folder, 'in.bag')
        record(bag, frame)
        first, _ = self.offline(bag, 'first')
        second, out = self.offline(bag, 'second')
        self.assertEqual(first['hash'], second['hash'])
        self.assertEqual(first['poses_used'], 149)
        self.assertEqual(first['poses_dropped'], 1)
        self.assertEqual(first['non_finite'], 0)
        self.assertGreater(first['contact_steps'], 100)
        self.assertEqual(len(first['rows']), 149)
        for rate in (1, 5):
            state_hash, steps = self.played('%s_%d' % (name, rate), bag, rate)
            self.assertEqual(steps, str(first['steps']))
            self.assertEqual(state_hash, first['hash'], 'at rate %d' % rate)
        return out

    def test_bag_in_the_scenes_frame(self):
        out = self.compare('plain', 'world')
        with rosbag.Bag(out) as bag:
            topics = bag.get_type_and_topic_info().topics
            self.assertEqual({name: topic.msg_type for name, topic in topics.items()}, {
                '/tissue_sim/ball/topology': 'tissue_sim/TissueTopology',
                '/tissue_sim/ball/state': 'tissue_sim/TissueState',
                '/tissue_sim/contacts': 'tissue_sim/Contacts',
                '/tissue_sim/probe/measured_cf': 'geometry_msgs/WrenchStamped'})
            for _, message, time in bag.read_messages('/tissue_sim/ball/state'):
                self.assertEqual(message.header.stamp, time)

    def test_bag_with_transforms(self):
        self.compare('framed', 'arm')


if __name__ == '__main__':
    rospy.init_node('replay_test')
    rostest.rosrun('tissue_sim', 'replay_test', ReplayTest)
