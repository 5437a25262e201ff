#!/usr/bin/env python3
"""Poses in another frame than the scene's: tf2 takes them there, and the force goes back."""
import math
import struct
import unittest

import rospy
import rostest
from geometry_msgs.msg import TransformStamped, WrenchStamped
from tf2_msgs.msg import TFMessage
from tissue_sim.msg import Contacts

from running_node import BALL_RADIUS, PROBE_RADIUS, RunningNode, pose_message, stamp_of, wait_until

MS = 10**6  # ns
START = 1000 * 10**9
TOUCH = BALL_RADIUS + PROBE_RADIUS
HALF = math.sqrt(0.5)


def transform(child, translation, rotation, stamp=START):
    message = TransformStamped()
    message.header.frame_id = 'world'
    message.header.stamp = rospy.Time(stamp // 10**9, stamp % 10**9)
    message.child_frame_id = child
    (message.transform.translation.x, message.transform.translation.y,
     message.transform.translation.z) = translation
    (message.transform.rotation.x, message.transform.rotation.y, message.transform.rotation.z,
     message.transform.rotation.w) = rotation
    return message


class FramesTest(unittest.TestCase):
    def start(self, name, **parameters):
        node = RunningNode(name, keep_all_poses='true', **parameters)
        self.addCleanup(node.stop)
        return node

    def test_static_transform_there_and_back(self):
        # The arm's z axis is the world's x axis: a quarter turn about y.
        static = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        static.publish(TFMessage([transform('arm', (0.5, 0, 0), (0, HALF, 0, HALF))]))
        node = self.start('static_frame', tf_timeout=5.0)
        contacts = node.listen('contacts', Contacts)
        wrenches = node.listen('probe/measured_cf', WrenchStamped)
        # In the world: on the x axis, from 2 mm outside the ball to 4 mm inside.
        for i in range(20):
            x_in_world = TOUCH + 0.002 - 0.006 * i / 19
            node.poses.publish(pose_message(START + i * 5 * MS, (0, 0, x_in_world - 0.5), frame='arm'))
        end = START + 19 * 5 * MS
        self.assertTrue(wait_until(lambda: wrenches and stamp_of(wrenches[-1]) == end), node.diagnostics)
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == end))
        self.assertEqual(contacts[-1].header.frame_id, 'world')
        self.assertGreater(len(contacts[-1].contacts), 0)
        for contact in contacts[-1].contacts:
            self.assertGreater(contact.position.x, 0.6 * BALL_RADIUS, 'pressed where the x axis leaves the ball')
        self.assertEqual(wrenches[-1].header.frame_id, 'arm')
        force = wrenches[-1].wrench.force
        self.assertGreater(force.z, 0.0, 'out of the ball along x of the world is z of the arm')
        self.assertGreater(force.z, 5 * math.hypot(force.x, force.y))

    def test_missing_transform_holds_the_last_pose_and_is_counted(self):
        node = self.start('missing_frame', tf_timeout=0.2)
        contacts = node.listen('contacts', Contacts)
        for i in range(5):
            node.poses.publish(pose_message(START + i * 5 * MS, (0, 0, TOUCH - 0.001)))
        end = START + 4 * 5 * MS
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == end))
        for i in range(5, 8):
            node.poses.publish(pose_message(START + i * 5 * MS, (0, 0, TOUCH), frame='nowhere'))
        node.poses.publish(pose_message(START + 8 * 5 * MS, (0, 0, TOUCH), frame=''))
        self.assertTrue(node.counted('dropped_missing_transform', 4), node.diagnostics)
        self.assertEqual(stamp_of(contacts[-1]), end, 'no step without a pose')
        # It goes on with the next pose that can be used.
        node.poses.publish(pose_message(START + 10 * 5 * MS, (0, 0, TOUCH - 0.001)))
        self.assertTrue(wait_until(lambda: stamp_of(contacts[-1]) == START + 10 * 5 * MS))

    def test_hostile_transforms_do_not_end_the_node(self):
        class Liar(TFMessage):
            """Announces a hundred million transforms, ten gigabytes, in a hundred bytes."""
            def serialize(self, buff):
                buff.write(struct.pack('<I', 10**8) + bytes(96))

        node = self.start('hostile_frames', tf_timeout=0.2)
        contacts = node.listen('contacts', Contacts)
        moving = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self.assertTrue(wait_until(lambda: moving.get_num_connections() > 0))
        turn = (0, 0, 0, 1)
        moving.publish(TFMessage([transform('late', (0, 0, 0), turn, (2**32 - 1) * 10**9)]))
        moving.publish(TFMessage([transform('nan', (float('nan'), 0, 0), turn), transform('world', (0, 0, 0), turn),
                                  transform('zero', (0, 0, 0), (0, 0, 0, 0))]))
        moving.publish(Liar())
        moving.publish(TFMessage([transform('cart', (0, 0, TOUCH - 0.002), turn),
                                  transform('cart', (0, 0, TOUCH - 0.002), turn, START + 10**9)]))
        for i in range(5):
            node.poses.publish(pose_message(START + i * 5 * MS, (0, 0, 0), frame='cart'))
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == START + 4 * 5 * MS), node.diagnostics)

    def test_a_pose_waits_for_its_transform(self):
        node = self.start('late_frame', tf_timeout=5.0)
        contacts = node.listen('contacts', Contacts)
        moving = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self.assertTrue(wait_until(lambda: moving.get_num_connections() > 0))
        for i in range(5):
            node.poses.publish(pose_message(START + i * 5 * MS, (0, 0, 0), frame='cart'))
        rospy.sleep(0.3)
        self.assertEqual(len(contacts), 0)
        # The frame of the tip moves, the tip in it rests: halfway between the two transforms at the third pose.
        turn = (0, 0, 0, 1)
        moving.publish(TFMessage([transform('cart', (0, 0, TOUCH + 0.002), turn, START),
                                  transform('cart', (0, 0, TOUCH - 0.002), turn, START + 4 * 5 * MS)]))
        self.assertTrue(wait_until(lambda: contacts and stamp_of(contacts[-1]) == START + 4 * 5 * MS))
        self.assertTrue(node.counted('poses_used', 5), node.diagnostics)
        self.assertEqual(node.diagnostics['dropped_missing_transform'], '0')
        self.assertEqual(len(contacts[0].contacts), 0)
        self.assertGreater(len(contacts[-1].contacts), 0)


if __name__ == '__main__':
    rospy.init_node('frames_test')
    rostest.rosrun('tissue_sim', 'frames_test', FramesTest)
